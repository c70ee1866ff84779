//! The colour of a palette that is nearest to another one.

/// Cells along each side of the colour cube.
const SIDE: i32 = 16;
/// Codes along each side of a cell.
const CELL: i32 = 256 / SIDE;
/// The same of larger blocks of cells.
const BLOCKS: i32 = 4;
const BLOCK: i32 = 256 / BLOCKS;

/// How far two colours are apart: squared differences, weighted about as the eye weighs red, green and blue.
pub fn distance(a: [i32; 3], b: [i32; 3]) -> i32 {
    let [r, g, bl] = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    2 * r * r + 4 * g * g + 3 * bl * bl
}

/// For each cell of the colour cube the colours that may be nearest to something in it.
pub struct Nearest {
    palette: Vec<[i32; 3]>,
    /// Where the candidates of each cell begin, and all of them.
    starts: Vec<u32>,
    candidates: Vec<u8>,
}

impl Nearest {
    /// For a palette of 1 to 256 colours.
    pub fn new(palette: &[[u8; 3]]) -> Self {
        let palette: Vec<[i32; 3]> = palette.iter().map(|color| color.map(i32::from)).collect();
        let all: Vec<u8> = (0..palette.len()).map(|i| i as u8).collect();
        // What is in reach of a large block is looked at for the cells in it.
        let corner = |index: i32, side: i32| [index / (side * side), index / side % side, index % side];
        let in_block = |block| candidates(&palette, &all, corner(block, BLOCKS).map(|n| n * BLOCK), BLOCK);
        let blocks: Vec<Vec<u8>> = (0..BLOCKS * BLOCKS * BLOCKS).map(in_block).collect();
        let mut nearest = Nearest { palette, starts: vec![0], candidates: Vec::new() };
        for cell in 0..SIDE * SIDE * SIDE {
            let low = corner(cell, SIDE).map(|n| n * CELL);
            let block = low.iter().fold(0, |index, n| index * BLOCKS + n / BLOCK);
            nearest.candidates.extend(candidates(&nearest.palette, &blocks[block as usize], low, CELL));
            nearest.starts.push(nearest.candidates.len() as u32);
        }
        nearest
    }

    /// The place in the palette of the nearest colour, the first of equally near ones. Channels outside of 0 to 255
    /// count as the nearest code.
    pub fn index(&self, color: [i32; 3]) -> usize {
        let color = color.map(|x| x.clamp(0, 255));
        let cell = color.iter().fold(0, |index, x| index * SIDE + x / CELL) as usize;
        let [from, to] = [self.starts[cell], self.starts[cell + 1]].map(|n| n as usize);
        let near = self.candidates[from..to].iter();
        near.map(|i| usize::from(*i)).min_by_key(|i| distance(color, self.palette[*i])).unwrap_or(0)
    }

    pub fn color(&self, index: usize) -> [i32; 3] {
        self.palette[index]
    }
}

/// Those of some colours that may be nearest to something in a cube of `side` codes from `low` on.
fn candidates(palette: &[[i32; 3]], some: &[u8], low: [i32; 3], side: i32) -> Vec<u8> {
    let high = low.map(|n| n + side - 1);
    let farthest = |color: [i32; 3]| {
        let corner: [i32; 3] = std::array::from_fn(|i| if color[i] * 2 < low[i] + high[i] { high[i] } else { low[i] });
        distance(color, corner)
    };
    let closest = |color: [i32; 3]| {
        let inside: [i32; 3] = std::array::from_fn(|i| color[i].clamp(low[i], high[i]));
        distance(color, inside)
    };
    let color = |index: &u8| palette[usize::from(*index)];
    // Whatever is further off than this from all of the cube is nowhere the nearest in it.
    let bound = some.iter().map(|index| farthest(color(index))).min().unwrap_or(0);
    some.iter().copied().filter(|index| closest(color(index)) <= bound).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn it_is_what_looking_at_all_colours_finds(
            palette in proptest::collection::vec(any::<[u8; 3]>(), 1..257),
            wanted in proptest::collection::vec(any::<[u8; 3]>(), 50),
        ) {
            let nearest = Nearest::new(&palette);
            for color in wanted.iter().map(|color| color.map(i32::from)) {
                let all = palette.iter().map(|known| distance(color, known.map(i32::from))).enumerate();
                prop_assert_eq!(nearest.index(color), all.min_by_key(|(_, d)| *d).unwrap().0);
            }
        }
    }
}
