use crate::trace::simd::{Kernel, Wide, Width, lanes};
use crate::trace::soa::columns::Columns;
use crate::trace::soa::{Hit, HitLanes, Hits};

struct Put<'a>(&'a mut Columns<2>, u32);

impl Kernel for Put<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Wide>(self) {
        let numbers = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];
        let first = L::load(&numbers);
        self.0.compress_store(self.1, &[first, first + L::splat(10.0)]);
    }
}

#[test]
fn lanes_that_have_a_bit_become_rows() {
    for width in Width::all() {
        let (mut columns, mut expected) = (Columns::default(), Vec::new());
        for which in 0..256 {
            width.run(Put(&mut columns, which));
            expected.extend(lanes(which).map(|lane| [lane as f32, lane as f32 + 10.0]));
            assert_eq!(columns.len(), expected.len());
        }
        assert!((0..expected.len()).all(|i| columns.row(i) == expected[i]), "{width:?}");
        columns.clear();
        columns.push([1.0, 2.0]);
        assert_eq!((columns.len(), columns.row(0)), (1, [1.0, 2.0]));
    }
}

struct StoreHits<'a>(&'a mut Hits, &'a [u32], u32);

impl Kernel for StoreHits<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Wide>(self) {
        let t = L::load(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]);
        let bits = |x: u32| L::splat(f32::from_bits(x));
        let hits = HitLanes { t, u: t, v: t, primitive: bits(7), element: bits(9) };
        self.0.set_lanes(self.1, self.2, hits);
    }
}

#[test]
fn hits_of_eight_rays_go_where_their_rays_are() {
    for width in Width::all() {
        let mut hits = Hits::default();
        hits.reset(20);
        (0..20).for_each(|i| hits.set(i, None));
        let (row, apart) = ([3, 4, 5, 6, 7, 8, 9, 10], [0, 12, 13, 19]);
        width.run(StoreHits(&mut hits, &row, 0b1010_0001));
        width.run(StoreHits(&mut hits, &apart, 0b1111_1010));
        let hit = |t: f32| Some(Hit { t, primitive: 7, element: 9, u: t, v: t });
        let met: Vec<_> = hits.iter().enumerate().filter_map(|(i, hit)| Some((i, hit?))).collect();
        let expected = [(3, hit(1.0)), (8, hit(6.0)), (10, hit(8.0)), (12, hit(2.0)), (19, hit(4.0))];
        assert_eq!(met, expected.map(|(i, hit)| (i, hit.unwrap())), "{width:?}");
    }
}
