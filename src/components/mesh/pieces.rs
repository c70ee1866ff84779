//! A mesh as it is traced: the triangles that show, by what they wear, each corner with its normal.

use std::ops::Deref;
use std::sync::{Arc, PoisonError};

use glam::Vec3;

use super::creases::CornerNormals;
use super::data::{Piece, Recipe, Smoothing};
use super::{FaceSet, Mesh, MeshData};
use crate::components::Text;

/// All that shows of a mesh; the triangles of a piece are in the order of the mesh.
#[derive(Clone, Debug)]
pub enum Pieces {
    /// The mesh as it is.
    Whole(Piece),
    /// The parts that materials divide it into.
    Parts(Arc<[Piece]>),
}

impl Deref for Pieces {
    type Target = [Piece];

    fn deref(&self) -> &[Piece] {
        match self {
            Pieces::Whole(piece) => std::slice::from_ref(piece),
            Pieces::Parts(parts) => parts,
        }
    }
}

/// Recipes of one mesh that are remembered though nothing is traced by them: a script that turns a knob from frame to
/// frame must not fill memory.
const RECIPES: usize = 8;

impl Mesh {
    /// What of the mesh is traced, and as what; made once for each way in which its data are used.
    pub fn pieces(&self) -> Pieces {
        let data = &self.data;
        let smoothing = match (self.smooth, self.crease_angle) {
            (Some(false), _) => Smoothing::Nowhere,
            (_, Some(angle)) => Smoothing::UpTo(angle),
            (Some(true), None) => Smoothing::Everywhere,
            (None, None) if !data.smoothing.is_empty() => Smoothing::Groups,
            (None, None) => Smoothing::Nowhere,
        };
        let is_given = !data.normals.is_empty() && !data.lacks_normals();
        let smoothing = if is_given { Smoothing::Nowhere } else { smoothing };
        let as_it_is = match smoothing {
            Smoothing::Nowhere => true,
            Smoothing::Everywhere => data.normals.is_empty(),
            Smoothing::Groups | Smoothing::UpTo(_) => false,
        };
        let materials = self.file_materials && !data.materials.is_empty();
        let single = match &data.materials[..] {
            [one] if materials => covers(one, data).then(|| one.name.clone()),
            _ => None,
        };
        if as_it_is && self.group.is_none() && (!materials || single.is_some()) {
            let smooth = smoothing == Smoothing::Everywhere || !data.normals.is_empty();
            return Pieces::Whole(Piece { material: single, data: data.clone(), smooth });
        }
        let recipe = Recipe { group: self.group.clone(), smoothing, materials };
        // A thread that fell over left a whole list behind.
        let mut known = data.computed.pieces.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, pieces)) = known.iter().find(|(known, _)| *known == recipe) {
            return Pieces::Parts(pieces.clone());
        }
        let pieces: Arc<[Piece]> = cut(data, &recipe).into();
        if known.len() >= RECIPES {
            // What a frame uses is held by its columns; what is not could be made again.
            known.retain(|(_, pieces)| pieces.iter().any(|piece| Arc::strong_count(&piece.data) > 1));
        }
        known.push((recipe, pieces.clone()));
        Pieces::Parts(pieces)
    }
}

fn covers(set: &FaceSet, data: &MeshData) -> bool {
    set.runs == [[0, data.triangles.len() as u32]]
}

/// The pieces of a mesh by its recipe: what wears the entity's material, then what wears others, in their order.
fn cut(data: &MeshData, recipe: &Recipe) -> Vec<Piece> {
    let triangles = data.triangles.len();
    let mut wears = vec![0; triangles];
    let sets: &[FaceSet] = if recipe.materials { &data.materials } else { &[] };
    for (number, set) in sets.iter().enumerate() {
        set.triangles().for_each(|t| wears[t as usize] = number + 1);
    }
    let mut of_piece: Vec<Vec<u32>> = vec![Vec::new(); sets.len() + 1];
    let mut put = |t: u32| of_piece[wears[t as usize]].push(t);
    match &recipe.group {
        // A name that is not there was refused before.
        Some(name) => data.group(name).into_iter().flat_map(FaceSet::triangles).for_each(&mut put),
        None => (0..triangles as u32).for_each(&mut put),
    }
    let mut cutter = Cutter::new(data, recipe);
    let names = std::iter::once(None).chain(sets.iter().map(|set| Some(set.name.clone())));
    let pieces = names.zip(of_piece).filter(|(_, triangles)| !triangles.is_empty());
    pieces.map(|(material, triangles)| cutter.piece(material, &triangles)).collect()
}

/// Copies triangles with their vertices into meshes of their own.
struct Cutter<'a> {
    data: &'a MeshData,
    normals: NormalSource,
    /// The newest copy of each vertex in the piece at hand, and for each copy the one before it.
    newest: Vec<u32>,
    older: Vec<u32>,
    /// Vertex and normal of each copy.
    copies: Vec<[u32; 2]>,
}

/// Where the normals of corners come from that the data have none for.
enum NormalSource {
    None,
    PerVertex(Vec<Vec3>),
    PerCorner(CornerNormals),
}

const NONE: u32 = u32::MAX;

impl<'a> Cutter<'a> {
    fn new(data: &'a MeshData, recipe: &Recipe) -> Self {
        let normals = match recipe.smoothing {
            Smoothing::Nowhere => NormalSource::None,
            Smoothing::Everywhere => NormalSource::PerVertex(data.smooth_normals()),
            Smoothing::Groups => NormalSource::PerCorner(CornerNormals::of_groups(data)),
            Smoothing::UpTo(angle) => NormalSource::PerCorner(CornerNormals::up_to(data, angle)),
        };
        let newest = vec![NONE; data.vertices.len()];
        Cutter { data, normals, newest, older: Vec::new(), copies: Vec::new() }
    }

    fn piece(&mut self, material: Option<Text>, triangles: &[u32]) -> Piece {
        let data = self.data;
        let mut corners = Vec::with_capacity(triangles.len());
        for t in triangles {
            let vertices = data.triangles[*t as usize];
            corners.push(std::array::from_fn(|i| {
                let given = data.normals.get(vertices[i] as usize).is_some_and(|n| *n != Vec3::ZERO);
                let normal = match &self.normals {
                    NormalSource::PerCorner(corners) if !given => corners.of_triangle[*t as usize][i],
                    NormalSource::PerCorner(_) | NormalSource::PerVertex(_) | NormalSource::None => NONE,
                };
                self.copy(vertices[i], normal)
            }));
        }
        let each = |copy: &[u32; 2]| (copy[0] as usize, copy[1]);
        let copies = || self.copies.iter().map(each);
        let normal = |(v, n): (usize, u32)| match &self.normals {
            NormalSource::PerCorner(corners) if n != NONE => corners.normals[n as usize],
            NormalSource::PerVertex(normals) if data.normals.get(v).is_none_or(|n| *n == Vec3::ZERO) => normals[v],
            NormalSource::PerCorner(_) | NormalSource::PerVertex(_) | NormalSource::None => {
                data.normals.get(v).copied().unwrap_or(Vec3::ZERO)
            }
        };
        let smooth = !data.normals.is_empty() || !matches!(self.normals, NormalSource::None);
        let piece = MeshData {
            vertices: copies().map(|(v, _)| data.vertices[v]).collect(),
            origin: data.origin,
            triangles: corners,
            normals: if smooth { copies().map(normal).collect() } else { Vec::new() },
            uvs: copies().filter_map(|(v, _)| data.uvs.get(v).copied()).collect(),
            second_uvs: copies().filter_map(|(v, _)| data.second_uvs.get(v).copied()).collect(),
            colors: copies().filter_map(|(v, _)| data.colors.get(v).copied()).collect(),
            ..MeshData::default()
        };
        self.copies.drain(..).for_each(|[vertex, _]| self.newest[vertex as usize] = NONE);
        self.older.clear();
        Piece { material, data: Arc::new(piece), smooth }
    }

    /// The number of a vertex with a normal in the piece at hand.
    fn copy(&mut self, vertex: u32, normal: u32) -> u32 {
        let mut at = self.newest[vertex as usize];
        while at != NONE {
            if self.copies[at as usize][1] == normal {
                return at;
            }
            at = self.older[at as usize];
        }
        let number = self.copies.len() as u32;
        self.copies.push([vertex, normal]);
        self.older.push(std::mem::replace(&mut self.newest[vertex as usize], number));
        number
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec2;

    fn set(name: &str, runs: &[[u32; 2]]) -> FaceSet {
        FaceSet { name: name.into(), runs: runs.to_vec() }
    }

    /// A strip of four triangles along x, bent by a right angle in the middle.
    fn strip() -> MeshData {
        let at = |x: f32, z: f32| [Vec3::new(x, 0.0, z), Vec3::new(x, 1.0, z)];
        let vertices = [at(0.0, 0.0), at(1.0, 0.0), at(1.0, -1.0)].concat();
        let triangles = vec![[0, 2, 1], [1, 2, 3], [2, 4, 3], [3, 4, 5]];
        MeshData::new(vertices, triangles, Vec::new())
    }

    fn mesh(data: MeshData) -> Mesh {
        Mesh { data: Arc::new(data), ..Mesh::default() }
    }

    /// Normals at the corners of the triangles of all pieces.
    fn normals(mesh: &Mesh) -> Vec<[Vec3; 3]> {
        let of = |piece: &Piece| {
            let at = |i: u32| if piece.smooth { piece.data.shading_normals()[i as usize] } else { Vec3::ZERO };
            piece.data.triangles.iter().map(|t| t.map(at)).collect::<Vec<_>>()
        };
        mesh.pieces().iter().flat_map(of).collect()
    }

    #[test]
    fn a_plain_mesh_is_traced_as_it_is() {
        let whole = mesh(strip());
        let pieces = whole.pieces();
        assert!(matches!(&pieces, Pieces::Whole(piece) if Arc::ptr_eq(&piece.data, &whole.data) && !piece.smooth));
        let smooth = Mesh { smooth: Some(true), ..whole };
        assert!(matches!(&smooth.pieces(), Pieces::Whole(piece) if piece.smooth));
    }

    #[test]
    fn materials_divide_a_mesh_and_a_group_picks_from_it() {
        let data = MeshData {
            uvs: (0..6).map(|i| Vec2::splat(i as f32)).collect(),
            materials: vec![set("red", &[[1, 3]]), set("green", &[[3, 4]])],
            groups: vec![set("left", &[[0, 2]]), set("right", &[[2, 4]])],
            ..strip()
        };
        let whole = mesh(data);
        let names = |mesh: &Mesh| mesh.pieces().iter().map(|p| p.material.as_deref().map(str::to_string)).collect();
        let counts = |mesh: &Mesh| mesh.pieces().iter().map(|p| p.data.triangles.len()).collect::<Vec<_>>();
        let all: Vec<Option<String>> = names(&whole);
        assert_eq!(all, [None, Some("red".into()), Some("green".into())]);
        assert_eq!(counts(&whole), [1, 2, 1]);
        let last = &whole.pieces()[2].data;
        assert_eq!((last.vertices.len(), last.uvs.len()), (3, 3));
        assert_eq!(last.triangles.iter().flatten().map(|i| last.uvs[*i as usize].x).sum::<f32>(), 3.0 + 4.0 + 5.0);
        let right = Mesh { group: Some("right".into()), ..whole.clone() };
        assert_eq!(counts(&right), [1, 1]);
        assert_eq!(counts(&Mesh { file_materials: false, ..right }), [2]);
        assert!(Arc::ptr_eq(&whole.pieces()[0].data, &whole.pieces()[0].data), "made once");
    }

    #[test]
    fn normals_are_joined_over_the_borders_of_materials_and_groups() {
        let smooth = Mesh { smooth: Some(true), ..mesh(strip()) };
        let data =
            MeshData { materials: vec![set("red", &[[2, 4]])], groups: vec![set("right", &[[2, 4]])], ..strip() };
        let divided = Mesh { smooth: Some(true), ..mesh(data) };
        assert_eq!(normals(&divided), normals(&smooth));
        assert_eq!(normals(&Mesh { group: Some("right".into()), ..divided }), normals(&smooth)[2..]);
    }

    #[test]
    fn creases_stay_sharp_and_shallow_edges_do_not() {
        let sharp = normals(&Mesh { crease_angle: Some(80.0), ..mesh(strip()) });
        assert_eq!(sharp, [[Vec3::Z; 3], [Vec3::Z; 3], [Vec3::X; 3], [Vec3::X; 3]]);
        let joined = normals(&Mesh { crease_angle: Some(100.0), ..mesh(strip()) });
        let close = |a: Vec3, b: Vec3| (a - b).length() < 1e-6;
        assert!(close(joined[1][2].normalize(), joined[2][2].normalize()) && joined[1][2].x > 0.3, "{joined:?}");
    }

    #[test]
    fn smoothing_groups_say_where_a_mesh_is_smooth() {
        let grouped = |smoothing: [u32; 4]| mesh(MeshData { smoothing: smoothing.to_vec(), ..strip() });
        let apart = normals(&grouped([1, 1, 2, 2]));
        assert_eq!(apart.map_normalized(), [[Vec3::Z; 3], [Vec3::Z; 3], [Vec3::X; 3], [Vec3::X; 3]]);
        assert_eq!(normals(&grouped([0, 0, 0, 0])), [[Vec3::ZERO; 3]; 4]);
        let everywhere = normals(&Mesh { smooth: Some(true), ..mesh(strip()) });
        assert_eq!(normals(&Mesh { smooth: Some(true), ..grouped([1, 1, 2, 2]) }), everywhere);
        assert_eq!(normals(&Mesh { smooth: Some(false), ..grouped([1, 1, 2, 2]) }), [[Vec3::ZERO; 3]; 4]);
    }

    #[test]
    fn given_normals_stay_and_missing_ones_are_computed() {
        let mut given = vec![Vec3::ZERO; 6];
        given[0] = Vec3::Y;
        let data = MeshData { normals: given, ..strip() };
        let flat = normals(&mesh(data.clone()));
        assert_eq!((flat[0][0], flat[3][0]), (Vec3::Y, Vec3::ZERO));
        let filled = normals(&Mesh { smooth: Some(true), ..mesh(data) });
        assert_eq!((filled[0][0], filled[3][1]), (Vec3::Y, Vec3::X));
    }

    trait Normalized {
        fn map_normalized(self) -> Vec<[Vec3; 3]>;
    }

    impl Normalized for Vec<[Vec3; 3]> {
        fn map_normalized(self) -> Vec<[Vec3; 3]> {
            self.into_iter().map(|t| t.map(Vec3::normalize)).collect()
        }
    }
}
