//! A rectangle of the pixels of a frame.

/// A rectangle of pixels that lies in a frame, counted from the frame's top left corner (the pixel bounds of pbrt).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelBounds {
    /// The top left pixel.
    pub origin: [u32; 2],
    /// Width and height, one pixel at least.
    pub size: [u32; 2],
}

impl PixelBounds {
    /// All pixels of a frame.
    pub fn whole(size: [u32; 2]) -> Self {
        PixelBounds { origin: [0; 2], size }
    }

    /// The column to the right of the last one, and the row below.
    pub fn end(self) -> [u32; 2] {
        std::array::from_fn(|axis| self.origin[axis] + self.size[axis])
    }

    fn between(origin: [u32; 2], end: [u32; 2]) -> Self {
        PixelBounds { origin, size: std::array::from_fn(|axis| end[axis] - origin[axis]) }
    }

    /// With so many pixels more on every side, as far as a frame of this size goes.
    pub fn grown(self, by: u32, frame: [u32; 2]) -> Self {
        let end = self.end();
        Self::between(
            self.origin.map(|at| at.saturating_sub(by)),
            std::array::from_fn(|axis| end[axis].saturating_add(by).min(frame[axis])),
        )
    }

    /// Grown to whole squares of the frame, which have this side and are counted from its corner.
    pub fn in_squares(self, side: u32, frame: [u32; 2]) -> Self {
        let end = self.end();
        Self::between(
            self.origin.map(|at| at / side * side),
            std::array::from_fn(|axis| end[axis].next_multiple_of(side).min(frame[axis])),
        )
    }

    /// Whether a pixel of the frame lies in it.
    pub fn contains(self, pixel: [u32; 2]) -> bool {
        (0..2).all(|axis| (self.origin[axis]..self.end()[axis]).contains(&pixel[axis]))
    }

    /// What both cover; `None` if they have no pixel in common.
    pub fn common(self, other: PixelBounds) -> Option<PixelBounds> {
        let origin: [u32; 2] = std::array::from_fn(|axis| self.origin[axis].max(other.origin[axis]));
        let end: [u32; 2] = std::array::from_fn(|axis| self.end()[axis].min(other.end()[axis]));
        (origin[0] < end[0] && origin[1] < end[1]).then(|| Self::between(origin, end))
    }

    /// How many pixels it has.
    pub fn count(self) -> usize {
        self.size[0] as usize * self.size[1] as usize
    }

    /// Number of a pixel in it, row by row.
    pub fn index(self, [x, y]: [u32; 2]) -> usize {
        (y - self.origin[1]) as usize * self.size[0] as usize + (x - self.origin[0]) as usize
    }

    /// Of a column with a value for each pixel of `self`, row by row, the values of a rectangle inside of it; an empty
    /// column stays empty.
    pub fn crop<T: Copy>(self, column: &[T], part: PixelBounds) -> Vec<T> {
        let width = part.size[0] as usize;
        let rows = (part.origin[1]..part.end()[1]).map(|y| self.index([part.origin[0], y]));
        rows.filter_map(|first| column.get(first..first + width)).flatten().copied().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_grow_as_far_as_the_frame_goes() {
        let part = PixelBounds { origin: [5, 0], size: [3, 4] };
        assert_eq!(part.grown(2, [9, 20]), PixelBounds { origin: [3, 0], size: [6, 6] });
        assert_eq!(part.in_squares(4, [9, 20]), PixelBounds { origin: [4, 0], size: [4, 4] });
        assert_eq!(part.in_squares(16, [9, 20]), PixelBounds { origin: [0, 0], size: [9, 16] });
        assert_eq!(part.common(part.grown(2, [9, 20])), Some(part));
        assert_eq!(part.common(PixelBounds { origin: [8, 0], size: [1, 1] }), None);
        assert!(part.contains([7, 3]) && !part.contains([8, 3]) && !part.contains([5, 4]));
    }

    #[test]
    fn a_part_of_a_column_is_its_rows() {
        let whole = PixelBounds { origin: [2, 1], size: [4, 3] };
        let column: Vec<u32> = (0..12).collect();
        assert_eq!(whole.crop(&column, PixelBounds { origin: [3, 2], size: [2, 2] }), [5, 6, 9, 10]);
        assert_eq!(whole.crop(&column, whole), column);
        assert!(whole.crop::<u32>(&[], whole).is_empty());
    }
}
