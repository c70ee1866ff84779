//! Directions in proportion to radiance: piecewise constant over a grid of angles (pbrt-v4, sections A.5.5 and 12.5.1).
//!
//! Columns share out the angle around y evenly, rows the angle from -y to +y. Inside a cell directions are uniform per
//! solid angle, so that the density is constant there and adds up to one exactly.

use glam::Vec3;

use crate::base::color::luminance;

#[derive(Clone, Debug, PartialEq)]
pub struct SphericalDistribution {
    width: usize,
    height: usize,
    /// Heights (y) of the borders between rows, from -1 to 1.
    borders: Vec<f32>,
    /// Share of all rows below each, from 0 to 1.
    rows: Vec<f32>,
    /// By row: share of its cells before each, from 0 to 1.
    columns: Vec<f32>,
}

const TURN: f32 = std::f32::consts::TAU;

/// Largest grid: cells of a third of the sun's diameter.
const COLUMNS: u32 = 2048;

const ROWS: u32 = 1024;

impl SphericalDistribution {
    /// `width` and `height` are those of the source; cells of a grid that is coarser look at several of its texels.
    pub fn new(width: u32, height: u32, radiance: impl Fn(Vec3) -> Vec3) -> Self {
        let (columns, rows) = (width.clamp(1, COLUMNS), height.clamp(2, ROWS));
        // Looks per cell and axis: at texels' corners and middles, so that none that is seen gets the density 0.
        let looks = |size: u32, cells: u32| 2 * size.div_ceil(cells).max(1);
        let (across, down) = (looks(width, columns), looks(height, rows));
        let direction = |column: u32, row: u32| {
            let around = TURN * (column as f32 / (columns * across) as f32 - 0.5);
            let (sin, cos) = libm::sincosf(around);
            let (radius, y) = libm::sincosf(0.5 * TURN * row as f32 / (rows * down) as f32);
            Vec3::new(radius * sin, -y, -radius * cos)
        };
        let border = |row: u32| -libm::cos(std::f64::consts::PI * f64::from(row) / f64::from(rows)) as f32;
        let mut borders: Vec<f32> = (0..=rows).map(border).collect();
        (borders[0], borders[rows as usize]) = (-1.0, 1.0);
        let mut cells = vec![0.0f64; (columns * rows) as usize];
        let luminous =
            |column: u32, row: u32| f64::from(luminance(radiance(direction(column, row)).to_array())).max(0.0);
        let mut line = vec![0.0f64; (columns * across + 1) as usize];
        for row in 0..rows * down + 1 {
            for (i, look) in line.iter_mut().enumerate() {
                *look = luminous(i as u32, row);
            }
            // Looks on a border count for the cells on both sides.
            let owners = [row / down, (row.max(1) - 1) / down];
            for owner in owners.into_iter().filter(|r| *r < rows).take(if owners[0] == owners[1] { 1 } else { 2 }) {
                for column in 0..columns {
                    let from = (column * across) as usize;
                    let sum: f64 = line[from..=from + across as usize].iter().sum();
                    cells[(owner * columns + column) as usize] += sum;
                }
            }
        }
        Self::from_cells(columns as usize, rows as usize, borders, &mut cells)
    }

    /// `cells` are mean luminances, up to a factor.
    fn from_cells(width: usize, height: usize, borders: Vec<f32>, cells: &mut [f64]) -> Self {
        if cells.iter().all(|x| *x <= 0.0) {
            cells.fill(1.0);
        }
        let share = |mut sums: Vec<f64>| -> Vec<f32> {
            let total = *sums.last().unwrap_or(&0.0);
            sums.iter_mut().for_each(|s| *s = if total > 0.0 { *s / total } else { 0.0 });
            sums.into_iter().map(|s| s as f32).collect()
        };
        let summed = |values: &mut dyn Iterator<Item = f64>| {
            let mut sum = 0.0;
            let mut sums = vec![0.0];
            sums.extend(values.map(|x| {
                sum += x;
                sum
            }));
            sums
        };
        let mut columns = Vec::with_capacity(height * (width + 1));
        let mut weights = Vec::with_capacity(height);
        for (row, cells) in cells.chunks(width).enumerate() {
            let sums = summed(&mut cells.iter().copied());
            weights.push(sums[width] * f64::from(borders[row + 1] - borders[row]));
            columns.extend(share(sums));
        }
        let rows = share(summed(&mut weights.into_iter()));
        SphericalDistribution { width, height, borders, rows, columns }
    }

    fn of_row(&self, row: usize) -> &[f32] {
        &self.columns[row * (self.width + 1)..(row + 1) * (self.width + 1)]
    }

    fn density(&self, row: usize, column: usize) -> f32 {
        let columns = self.of_row(row);
        let share = (self.rows[row + 1] - self.rows[row]) * (columns[column + 1] - columns[column]);
        let angle = TURN / self.width as f32 * (self.borders[row + 1] - self.borders[row]);
        share / angle
    }

    /// A direction and its density.
    pub fn sample(&self, [x, y]: [f32; 2]) -> (Vec3, f32) {
        let (row, up) = find(&self.rows, y);
        let (column, along) = find(self.of_row(row), x);
        let (low, high) = (self.borders[row], self.borders[row + 1]);
        let y = low + (high - low) * up;
        let radius = (1.0 - y * y).max(0.0).sqrt();
        let (sin, cos) = libm::sincosf(TURN * ((column as f32 + along) / self.width as f32 - 0.5));
        (Vec3::new(radius * sin, y, -radius * cos), self.density(row, column))
    }

    /// Density of a direction.
    pub fn pdf(&self, d: Vec3) -> f32 {
        let row = self.borders.partition_point(|border| *border <= d.y).clamp(1, self.height) - 1;
        let around = 0.5 + libm::atan2f(d.x, -d.z) / TURN;
        let column = ((around * self.width as f32) as usize).min(self.width - 1);
        self.density(row, column)
    }
}

/// The step of a rising sequence from 0 to 1 that holds `x`, and how far along it; steps of no height hold nothing.
fn find(sums: &[f32], x: f32) -> (usize, f32) {
    let after = sums.partition_point(|sum| *sum <= x).clamp(1, sums.len() - 1);
    // Past the last step that has a height there is only rounding.
    let last = (1..=after).rev().find(|i| sums[*i] > sums[*i - 1]).unwrap_or(after);
    let (low, high) = (sums[last - 1], sums[last]);
    let along = if high > low { (x - low) / (high - low) } else { 0.0 };
    (last - 1, along.clamp(0.0, 1.0 - f32::EPSILON))
}
