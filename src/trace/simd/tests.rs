//! Every width does what the single number does, bit for bit, whatever the numbers.

use proptest::prelude::*;

use super::plain::Plain;
use super::*;

/// All operations on two lists of eight, one result after the other.
struct Everything([f32; LANES], [f32; LANES]);

impl Kernel for Everything {
    type Output = Vec<u32>;

    #[inline(always)]
    fn run<L: Wide>(self) -> Vec<u32> {
        let (a, b) = (L::load(&self.0), L::load(&self.1));
        let mut out = Vec::new();
        for x in [a + b, a - b, a * b, a / b, a.min(b), a.max(b), a.abs(), a.sqrt(), -a, a.next_up(), a.next_down()] {
            out.extend(x.store().map(canonical));
        }
        out.extend(L::select(a.lt(b), a, b).store().map(canonical));
        let (less, level) = (a.lt(b), a.le(b));
        out.extend([less, level, a.ne(b), L::not(less), L::and(less, a.ne(b)), L::or(less, b.lt(a))].map(L::bits));
        assert!((0..256).all(|bits| L::bits(L::mask(bits)) == bits));
        out
    }
}

/// The payload of a NaN is nobody's business.
fn canonical(x: f32) -> u32 {
    if x.is_nan() { f32::NAN.to_bits() } else { x.to_bits() }
}

fn one_by_one(a: [f32; LANES], b: [f32; LANES]) -> Vec<u32> {
    let mut out = Vec::new();
    let numbers: [fn(f32, f32) -> f32; 12] = [
        |a, b| a + b,
        |a, b| a - b,
        |a, b| a * b,
        |a, b| a / b,
        Lanes::min,
        Lanes::max,
        |a, _| Lanes::abs(a),
        |a, _| Lanes::sqrt(a),
        |a, _| -a,
        |a, _| a.next_up(),
        |a, _| a.next_down(),
        |a, b| Lanes::select(Lanes::lt(a, b), a, b),
    ];
    for f in numbers {
        out.extend((0..LANES).map(|i| canonical(f(a[i], b[i]))));
    }
    let masks: [fn(f32, f32) -> bool; 6] = [
        |a, b| a < b,
        |a, b| a <= b,
        |a, b| a != b,
        |a, b| !Lanes::lt(a, b),
        |a, b| a < b && a != b,
        |a, b| a < b || b < a,
    ];
    out.extend(masks.map(|f| (0..LANES).fold(0, |bits, i| bits | u32::from(f(a[i], b[i])) << i)));
    out
}

fn number() -> impl Strategy<Value = f32> {
    let special = [0.0, -0.0, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, f32::MIN_POSITIVE, 1e-45, f32::MAX];
    prop_oneof![3 => -2.0f32..2.0, 1 => prop::sample::select(special.to_vec()), 1 => any::<f32>()]
}

/// All operations on whole numbers; results as floats, by halves that are exact.
struct Whole([u32; LANES], [u32; LANES]);

impl Kernel for Whole {
    type Output = Vec<[u32; LANES]>;

    #[inline(always)]
    fn run<L: Wide>(self) -> Vec<[u32; LANES]> {
        let (a, b) = (L::U32x8::load(&self.0), L::U32x8::load(&self.1));
        let table = self.1;
        let results = [
            a.wrapping_add(b),
            a.wrapping_mul(b),
            a.and(b),
            a.or(b),
            a.xor(b),
            a.shl::<5>(),
            a.shr::<7>(),
            a.shr_by(b),
            a.permute(&table),
            a.reverse_bits(),
            L::U32x8::splat(table[0]),
        ];
        let mut out = Vec::new();
        for x in results {
            let (low, high) = (x.and(L::U32x8::splat(0xffff)).to_floats().store(), x.shr::<16>().to_floats().store());
            out.push(std::array::from_fn(|i| low[i] as u32 | (high[i] as u32) << 16));
        }
        out
    }
}

struct BitPlanes([u8; 64]);

impl Kernel for BitPlanes {
    type Output = [u64; LANES];

    #[inline(always)]
    fn run<L: Wide>(self) -> [u64; LANES] {
        L::bit_planes(&self.0)
    }
}

fn whole_one_by_one(a: [u32; LANES], b: [u32; LANES]) -> Vec<[u32; LANES]> {
    let of = |f: &dyn Fn(u32, u32) -> u32| std::array::from_fn(|i| f(a[i], b[i]));
    vec![
        of(&u32::wrapping_add),
        of(&u32::wrapping_mul),
        of(&|a, b| a & b),
        of(&|a, b| a | b),
        of(&|a, b| a ^ b),
        of(&|a, _| a << 5),
        of(&|a, _| a >> 7),
        of(&|a, by| a >> (by & 31)),
        of(&|i, _| b[(i & 7) as usize]),
        of(&|a, _| a.reverse_bits()),
        [b[0]; LANES],
    ]
}

proptest! {
    #[test]
    fn whole_numbers_agree_in_all_widths(
        a in prop::array::uniform8(any::<u32>()),
        b in prop::array::uniform8(any::<u32>()),
    ) {
        for width in Width::all() {
            prop_assert_eq!(width.run(Whole(a, b)), whole_one_by_one(a, b), "{:?}", width);
        }
        prop_assert_eq!(Whole(a, b).run::<Plain>(), whole_one_by_one(a, b));
    }

    #[test]
    fn planes_of_bits_agree_in_all_widths(bytes in prop::collection::vec(any::<u8>(), 64)) {
        let bytes: [u8; 64] = bytes.try_into().expect("as many");
        let plane = |k: usize| (0..64).fold(0, |bits, i| bits | u64::from(bytes[i] >> k & 1) << i);
        let expected: [u64; LANES] = std::array::from_fn(plane);
        for width in Width::all() {
            prop_assert_eq!(width.run(BitPlanes(bytes)), expected, "{:?}", width);
        }
        prop_assert_eq!(BitPlanes(bytes).run::<Plain>(), expected);
    }

    #[test]
    fn all_widths_agree(a in prop::array::uniform8(number()), b in prop::array::uniform8(number())) {
        for width in Width::all() {
            prop_assert_eq!(width.run(Everything(a, b)), one_by_one(a, b), "{:?}", width);
        }
        prop_assert_eq!(Everything(a, b).run::<Plain>(), one_by_one(a, b));
    }
}
