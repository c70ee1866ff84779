//! A tree of lights, to choose one by what it is expected to bring to a point.
//!
//! A. Conty Estevez and C. Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting", HPG 2018, without the
//! splitting; bounds and importance as in pbrt-v4 (section 12.6.3), without the normal of the surface, which a ray that
//! meets a light by itself does not know any more.

use glam::Vec3;

use crate::trace::primitive::Bounds;

/// Where light comes from and where it goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightBounds {
    /// Around all points that emit.
    pub bounds: Bounds,
    /// What it brings to distance 1 at most, summed over the channels.
    pub power: f32,
    /// Unit; the middle of all normals.
    pub axis: Vec3,
    /// Cosine of how far normals are from the axis.
    pub normals: f32,
    /// Cosine of how far from its normal each point emits.
    pub emission: f32,
    /// Whether the same light goes to the other side.
    pub two_sided: bool,
}

/// A cone of directions that holds both; the first is the wider one if either holds the other.
fn cone_around((a, cos_a): (Vec3, f32), (b, cos_b): (Vec3, f32)) -> (Vec3, f32) {
    let angle = |cos: f32| libm::acosf(cos.clamp(-1.0, 1.0));
    let (theta_a, theta_b, between) = (angle(cos_a), angle(cos_b), angle(a.dot(b)));
    let pi = std::f32::consts::PI;
    if (between + theta_b).min(pi) <= theta_a {
        return (a, cos_a);
    }
    if (between + theta_a).min(pi) <= theta_b {
        return (b, cos_b);
    }
    let theta = 0.5 * (theta_a + between + theta_b);
    let across = a.cross(b).normalize_or_zero();
    if theta >= pi || across == Vec3::ZERO {
        return (a, -1.0);
    }
    let (sin, cos) = libm::sincosf(theta - theta_a);
    // Rodrigues' turn of an axis across.
    ((a * cos + across.cross(a) * sin).normalize_or(a), libm::cosf(theta))
}

/// Cosine and sine of the difference of two angles, 0 if the second is larger.
fn subtract_angles([cos_a, sin_a]: [f32; 2], [cos_b, sin_b]: [f32; 2]) -> [f32; 2] {
    if cos_a > cos_b { [1.0, 0.0] } else { [cos_a * cos_b + sin_a * sin_b, (sin_a * cos_b - cos_a * sin_b).max(0.0)] }
}

fn with_sine(cos: f32) -> [f32; 2] {
    [cos, (1.0 - cos * cos).max(0.0).sqrt()]
}

impl LightBounds {
    /// Both together.
    fn union(self, other: LightBounds) -> LightBounds {
        if self.power == 0.0 {
            return other;
        }
        if other.power == 0.0 {
            return self;
        }
        let (axis, normals) = cone_around((self.axis, self.normals), (other.axis, other.normals));
        LightBounds {
            bounds: self.bounds.union(other.bounds),
            power: self.power + other.power,
            axis,
            normals,
            emission: self.emission.min(other.emission),
            two_sided: self.two_sided || other.two_sided,
        }
    }

    /// What [`ImportanceTerms::importance`] asks for at every point.
    fn terms(&self) -> ImportanceTerms {
        let LightBounds { bounds, power, axis, normals, emission, two_sided } = *self;
        let radius = 0.5 * bounds.size().length();
        ImportanceTerms {
            center: bounds.center(),
            square_radius: radius * radius,
            power,
            axis,
            normals: with_sine(normals),
            emission,
            two_sided,
        }
    }

    /// The cost of a set of lights: power, times the measure of directions that it shines to, times the square of its
    /// extent.
    fn cost(&self, longest: f32, side: f32) -> f32 {
        let (open, emission) = (libm::acosf(self.normals.clamp(-1.0, 1.0)), libm::acosf(self.emission));
        let reach = (open + emission).min(std::f32::consts::PI);
        let sin = with_sine(self.normals)[1];
        let tail = 2.0 * reach * sin - libm::cosf(open - 2.0 * reach) - 2.0 * open * sin + self.normals;
        let measure = std::f32::consts::TAU * (1.0 - self.normals) + std::f32::consts::FRAC_PI_2 * tail;
        // The square across it stands for the area: of lights in a row there is none.
        self.power * measure * self.bounds.size().length_squared() * longest / side.max(1e-6 * longest)
    }
}

/// Light bounds as a walk through the tree looks at them.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ImportanceTerms {
    center: Vec3,
    /// Of the sphere around the box.
    square_radius: f32,
    power: f32,
    axis: Vec3,
    /// Cosine and sine of how far normals are from the axis.
    normals: [f32; 2],
    /// Cosine of how far from its normal each point emits.
    emission: f32,
    two_sided: bool,
}

impl ImportanceTerms {
    /// An estimate of what the lights bring to a point; 0 only where they bring nothing.
    fn importance(&self, from: Vec3) -> f32 {
        let away = from - self.center;
        let (square, least) = (away.length_squared(), self.square_radius);
        let mut cosine = self.axis.dot(away / square.sqrt().max(f32::MIN_POSITIVE));
        if self.two_sided {
            cosine = cosine.abs();
        }
        // Directions to all points of it are within this angle of that to its centre.
        let spread = if square <= least { -1.0 } else { (1.0 - least / square).max(0.0).sqrt() };
        let beyond_normals = subtract_angles(with_sine(cosine), self.normals);
        let [least_angle, _] = subtract_angles(beyond_normals, with_sine(spread));
        // Rounding must not hide what is seen under the very angle of the edge.
        if least_angle < self.emission - 1e-4 {
            return 0.0;
        }
        self.power * least_angle.max(1e-4) / square.max(least).max(f32::MIN_POSITIVE)
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct LightNode {
    light: ImportanceTerms,
    /// The second child, the first being the next node; of a leaf, the number of its light.
    next: u32,
    is_leaf: bool,
}

/// All lights that fall off with distance, in a tree of boxes and cones.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightTree {
    nodes: Vec<LightNode>,
    /// For each light, the way to its leaf: bit k says which child at depth k; all bits set for one that is not there.
    ways: Vec<u64>,
}

/// Slots of places along an axis that a set is split between.
const SLOTS: usize = 12;

/// Of more lights than these only one axis is tried.
const MANY: usize = 256;

/// Levels of a tree, as bits of a way.
const DEEPEST: u32 = u64::BITS - 1;

const NOWHERE: u64 = u64::MAX;

impl LightTree {
    /// The tree of lights by number; those without power are left out.
    pub fn new(lights: &[Option<LightBounds>]) -> LightTree {
        let mut tree = LightTree { nodes: Vec::new(), ways: vec![NOWHERE; lights.len()] };
        let found = lights.iter().enumerate().filter_map(|(i, light)| light.map(|light| (i as u32, light)));
        let mut all: Vec<(u32, LightBounds)> = found.filter(|(_, light)| light.power > 0.0).collect();
        if !all.is_empty() {
            tree.build(&mut all, 0, 0);
        }
        tree
    }

    fn build(&mut self, lights: &mut [(u32, LightBounds)], way: u64, depth: u32) -> LightBounds {
        if let [(number, light)] = lights {
            self.ways[*number as usize] = way;
            self.nodes.push(LightNode { light: light.terms(), next: *number, is_leaf: true });
            return *light;
        }
        let node = self.nodes.len();
        let middle = split(lights, depth);
        let (first, second) = lights.split_at_mut(middle);
        self.nodes.push(LightNode { light: first[0].1.terms(), next: 0, is_leaf: false });
        let near = self.build(first, way, depth + 1);
        let next = self.nodes.len() as u32;
        let far = self.build(second, way | 1 << depth, depth + 1);
        let light = near.union(far);
        self.nodes[node] = LightNode { light: light.terms(), next, is_leaf: false };
        light
    }

    /// What all lights are estimated to bring to a point.
    pub fn importance(&self, from: Vec3) -> f32 {
        self.nodes.first().map_or(0.0, |root| root.light.importance(from))
    }

    /// A light for a number in 0..1, with the chance of it; `None` where none shines to.
    pub fn pick(&self, from: Vec3, mut u: f32) -> Option<(u32, f32)> {
        let mut at = 0;
        let mut chance = 1.0;
        loop {
            let node = self.nodes.get(at)?;
            if node.is_leaf {
                return (node.light.importance(from) > 0.0).then_some((node.next, chance));
            }
            let first = self.share(at, from)?;
            if u < first {
                (u, chance, at) = (u / first, chance * first, at + 1);
            } else {
                (u, chance, at) = ((u - first) / (1.0 - first), chance * (1.0 - first), node.next as usize);
            }
            u = u.clamp(0.0, 1.0 - f32::EPSILON / 2.0);
        }
    }

    /// The chance that [`Self::pick`] gives a light.
    pub fn chance(&self, from: Vec3, light: u32) -> f32 {
        let way = self.ways.get(light as usize).copied().unwrap_or(NOWHERE);
        if way == NOWHERE {
            return 0.0;
        }
        let (mut at, mut chance, mut depth) = (0, 1.0, 0);
        loop {
            let node = &self.nodes[at];
            if node.is_leaf {
                return if node.light.importance(from) > 0.0 { chance } else { 0.0 };
            }
            let Some(first) = self.share(at, from) else { return 0.0 };
            if way >> depth & 1 == 0 {
                (chance, at) = (chance * first, at + 1);
            } else {
                (chance, at) = (chance * (1.0 - first), node.next as usize);
            }
            depth += 1;
        }
    }

    /// The chance of the first child of a node; `None` if neither shines to the point.
    fn share(&self, node: usize, from: Vec3) -> Option<f32> {
        let [first, second] = [node + 1, self.nodes[node].next as usize].map(|i| self.nodes[i].light.importance(from));
        (first + second > 0.0).then(|| first / (first + second))
    }
}

/// Orders lights so that the first part of them and the rest are cheap to tell apart; gives where the rest starts.
fn split(lights: &mut [(u32, LightBounds)], depth: u32) -> usize {
    let centers =
        lights.iter().fold(Bounds::default(), |b, (_, light)| b.union(Bounds::around(&[light.bounds.center()])));
    let size = lights.iter().fold(Bounds::default(), |b, (_, light)| b.union(light.bounds)).size();
    let longest = size.max_element();
    // Halves leave room for the levels that are still to come.
    let is_deep = depth + lights.len().ilog2() + 1 >= DEEPEST;
    let spread = centers.size();
    // Of many, the axis that they are spread along most is as good as the best of three.
    let is_tried = |axis: usize| spread[axis] > 0.0 && (lights.len() <= MANY || spread[axis] == spread.max_element());
    let axes: Vec<usize> = (0..3).filter(|axis| !is_deep && is_tried(*axis)).collect();
    let mut best: Option<(f32, usize, usize)> = None;
    for axis in axes {
        let mut slots = [None::<LightBounds>; SLOTS];
        for (_, light) in lights.iter() {
            let slot = &mut slots[slot_of(light, &centers, axis)];
            *slot = Some(slot.map_or(*light, |known| known.union(*light)));
        }
        let join = |part: &[Option<LightBounds>]| part.iter().flatten().copied().reduce(LightBounds::union);
        for at in 1..SLOTS {
            let (Some(low), Some(high)) = (join(&slots[..at]), join(&slots[at..])) else { continue };
            let cost = low.cost(longest, size[axis]) + high.cost(longest, size[axis]);
            if best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, axis, at));
            }
        }
    }
    match best {
        Some((_, axis, at)) => {
            // A stable order: equal lights make equal trees.
            lights.sort_by_key(|(_, light)| slot_of(light, &centers, axis) >= at);
            lights.partition_point(|(_, light)| slot_of(light, &centers, axis) < at)
        }
        None => lights.len() / 2,
    }
}

fn slot_of(light: &LightBounds, centers: &Bounds, axis: usize) -> usize {
    let across = centers.max[axis] - centers.min[axis];
    let share = (light.bounds.center()[axis] - centers.min[axis]) / across;
    ((share * SLOTS as f32) as usize).min(SLOTS - 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::random::{hash_words, unit_f32};

    fn lamp(at: Vec3, power: f32) -> LightBounds {
        LightBounds {
            bounds: Bounds { min: at, max: at },
            power,
            axis: Vec3::Y,
            normals: -1.0,
            emission: 0.0,
            two_sided: false,
        }
    }

    fn number(i: u64, k: u64) -> f32 {
        unit_f32(hash_words([i, k]))
    }

    /// Lights of all kinds: points, flat ones of one and of two sides, spots.
    fn lights(count: u64) -> Vec<Option<LightBounds>> {
        let one = |i: u64| {
            let at = Vec3::new(number(i, 0), number(i, 1), number(i, 2)) * 10.0 - 5.0;
            let axis = Vec3::new(number(i, 3) - 0.5, number(i, 4) - 0.5, number(i, 5) - 0.5).normalize_or(Vec3::Y);
            let plain = lamp(at, 0.1 + number(i, 6));
            let wide = Bounds { min: at - 0.2, max: at + 0.2 };
            match i % 5 {
                0 => Some(plain),
                1 => Some(LightBounds { bounds: wide, axis, normals: 1.0, ..plain }),
                2 => Some(LightBounds { bounds: wide, axis, normals: 1.0, two_sided: true, ..plain }),
                3 => Some(LightBounds { axis, normals: 1.0, emission: 0.9, ..plain }),
                _ => None,
            }
        };
        (0..count).map(one).collect()
    }

    fn points() -> impl Iterator<Item = Vec3> {
        (0..20).map(|i| Vec3::new(number(i, 7), number(i, 8), number(i, 9)) * 14.0 - 7.0)
    }

    #[test]
    fn chances_are_those_of_picking_and_add_up_to_one() {
        let lights = lights(300);
        let tree = LightTree::new(&lights);
        for from in points() {
            let chances: Vec<f32> = (0..300).map(|i| tree.chance(from, i)).collect();
            let total: f32 = chances.iter().sum();
            // Boxes may promise what none of their lights keeps: that share of picks finds nothing.
            assert!(total <= 1.001 && total > 0.5, "{total}");
            let (picks, mut found) = (20_000, vec![0u32; 300]);
            for k in 0..picks {
                if let Some((light, chance)) = tree.pick(from, (k as f32 + 0.5) / picks as f32) {
                    assert_eq!(chance, chances[light as usize]);
                    found[light as usize] += 1;
                }
            }
            for (light, (found, chance)) in found.iter().zip(&chances).enumerate() {
                let share = *found as f32 / picks as f32;
                assert!((share - chance).abs() < 5e-4, "{light}: {share} {chance}");
            }
        }
    }

    #[test]
    fn every_light_that_shines_to_a_point_can_be_picked() {
        let lights = lights(300);
        let tree = LightTree::new(&lights);
        for from in points() {
            for (i, light) in lights.iter().enumerate() {
                let shines = light.is_some_and(|light| light.terms().importance(from) > 0.0);
                assert_eq!(tree.chance(from, i as u32) > 0.0, shines, "{i} {from}");
            }
        }
    }

    #[test]
    fn near_lights_are_picked_most() {
        let row: Vec<_> = (0..1000).map(|i| Some(lamp(Vec3::X * i as f32, 1.0))).collect();
        let tree = LightTree::new(&row);
        let from = Vec3::new(500.2, 1.0, 0.0);
        let near: f32 = (490..=510).map(|i| tree.chance(from, i)).sum();
        // By power alone it would be 0.02; by the square of distances 0.94 of all light comes from these.
        assert!(near > 0.4, "{near}");
    }

    #[test]
    fn lights_of_one_place_make_a_tree_that_is_not_deep() {
        let tree = LightTree::new(&vec![Some(lamp(Vec3::ONE, 1.0)); 5000]);
        let chance = tree.chance(Vec3::ZERO, 4321);
        assert!((chance * 5000.0 - 1.0).abs() < 0.8, "{chance}");
        assert!((0..5000).map(|i| tree.chance(Vec3::ZERO, i)).sum::<f32>() > 0.99);
    }
}
