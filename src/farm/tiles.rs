//! One picture in parts, for as many machines.

/// Side of the squares that parts are made of: that of the tiles that frames are traced in, so that no square is traced
/// by two.
const SQUARE: u32 = 16;

/// The i-th of n parts of a frame of this size, from 1: left, top, width and height. Parts are as square as they can be,
/// since what looks at neighbours is traced around each; `None` if there are more parts than squares.
pub fn part_of(size: [u32; 2], i: u32, n: u32) -> Option<[u32; 4]> {
    let squares = size.map(|side| side.div_ceil(SQUARE));
    let columns =
        (1..=n).filter(|columns| n.is_multiple_of(*columns) && *columns <= squares[0] && n / columns <= squares[1]);
    let half_perimeter =
        |columns: u32| f64::from(size[0]) / f64::from(columns) + f64::from(size[1]) * f64::from(columns) / f64::from(n);
    let columns = columns.min_by(|a, b| half_perimeter(*a).total_cmp(&half_perimeter(*b)))?;
    let rows = n / columns;
    let cut = |axis: usize, part: u32, parts: u32| {
        let square = (u64::from(part) * u64::from(squares[axis]) / u64::from(parts)) as u32;
        (square * SQUARE).min(size[axis])
    };
    let (column, row) = ((i - 1) % columns, (i - 1) / columns);
    let (left, right) = (cut(0, column, columns), cut(0, column + 1, columns));
    let (top, bottom) = (cut(1, row, rows), cut(1, row + 1, rows));
    Some([left, top, right - left, bottom - top])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_cover_the_frame_once() {
        for (size, n) in
            [([90, 80], 4), ([64, 36], 6), ([1920, 1080], 7), ([1920, 1080], 64), ([17, 16], 2), ([5, 5], 1)]
        {
            let mut seen = vec![0; (size[0] * size[1]) as usize];
            for i in 1..=n {
                let [x, y, width, height] = part_of(size, i, n).unwrap();
                assert!(width > 0 && height > 0, "{size:?} {i}/{n}");
                for row in y..y + height {
                    (x..x + width).for_each(|column| seen[(row * size[0] + column) as usize] += 1);
                }
            }
            assert!(seen.iter().all(|times| *times == 1), "{size:?} {n}");
        }
        assert_eq!(part_of([1920, 1080], 1, 4), Some([0, 0, 960, 544]));
        assert_eq!(part_of([16, 16], 1, 2), None);
    }
}
