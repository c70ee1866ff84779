//! Work items: what travels in queues, declared once, from which its columns, rows and lanes follow.

use glam::Vec3;

use crate::trace::simd::{Lanes, V3};

/// A value that takes some columns of 32 bits each.
///
/// Everything in it is to be marked `#[inline(always)]`, see [`crate::trace::simd::Kernel::run`].
pub trait Field: Copy {
    /// How many columns it takes.
    const COLUMNS: usize;
    /// Eight of it side by side; whole numbers by their bits.
    type Side<L: Lanes>: Copy;

    /// Writes it into a row, from column `at` on.
    fn put<const N: usize>(self, row: &mut [f32; N], at: usize);
    /// Reads it from a row, from column `at` on.
    fn take<const N: usize>(row: &[f32; N], at: usize) -> Self;
    /// As [`Self::put`], for eight rows.
    fn put_lanes<L: Lanes, const N: usize>(lanes: Self::Side<L>, rows: &mut [L; N], at: usize);
    /// As [`Self::take`], for eight rows.
    fn take_lanes<L: Lanes, const N: usize>(rows: &[L; N], at: usize) -> Self::Side<L>;
}

impl Field for f32 {
    const COLUMNS: usize = 1;
    type Side<L: Lanes> = L;

    #[inline(always)]
    fn put<const N: usize>(self, row: &mut [f32; N], at: usize) {
        row[at] = self;
    }
    #[inline(always)]
    fn take<const N: usize>(row: &[f32; N], at: usize) -> Self {
        row[at]
    }
    #[inline(always)]
    fn put_lanes<L: Lanes, const N: usize>(lanes: L, rows: &mut [L; N], at: usize) {
        rows[at] = lanes;
    }
    #[inline(always)]
    fn take_lanes<L: Lanes, const N: usize>(rows: &[L; N], at: usize) -> L {
        rows[at]
    }
}

impl Field for u32 {
    const COLUMNS: usize = 1;
    type Side<L: Lanes> = L;

    #[inline(always)]
    fn put<const N: usize>(self, row: &mut [f32; N], at: usize) {
        row[at] = f32::from_bits(self);
    }
    #[inline(always)]
    fn take<const N: usize>(row: &[f32; N], at: usize) -> Self {
        row[at].to_bits()
    }
    #[inline(always)]
    fn put_lanes<L: Lanes, const N: usize>(lanes: L, rows: &mut [L; N], at: usize) {
        rows[at] = lanes;
    }
    #[inline(always)]
    fn take_lanes<L: Lanes, const N: usize>(rows: &[L; N], at: usize) -> L {
        rows[at]
    }
}

impl Field for Vec3 {
    const COLUMNS: usize = 3;
    type Side<L: Lanes> = V3<L>;

    #[inline(always)]
    fn put<const N: usize>(self, row: &mut [f32; N], at: usize) {
        (row[at], row[at + 1], row[at + 2]) = (self.x, self.y, self.z);
    }
    #[inline(always)]
    fn take<const N: usize>(row: &[f32; N], at: usize) -> Self {
        Vec3::new(row[at], row[at + 1], row[at + 2])
    }
    #[inline(always)]
    fn put_lanes<L: Lanes, const N: usize>(lanes: V3<L>, rows: &mut [L; N], at: usize) {
        (rows[at], rows[at + 1], rows[at + 2]) = (lanes.x, lanes.y, lanes.z);
    }
    #[inline(always)]
    fn take_lanes<L: Lanes, const N: usize>(rows: &[L; N], at: usize) -> V3<L> {
        V3 { x: rows[at], y: rows[at + 1], z: rows[at + 2] }
    }
}

/// Declares a work item: `One, Lanes, Columns { field: Type, ... }`, where every type is a [`Field`].
///
/// `One` is a struct with these fields, `Lanes` eight of it side by side, `Columns` many of it, with a method for every
/// field that loads the lanes of eight in a row.
macro_rules! work_item {
    (
        $(#[$meta:meta])*
        $One:ident, $Lanes:ident, $Columns:ident {
            $( $(#[$field_meta:meta])* $field:ident: $Type:ty, )*
        }
    ) => {
        $(#[$meta])*
        pub struct $One {
            $( $(#[$field_meta])* pub $field: $Type, )*
        }

        #[doc = concat!("Eight of [`", stringify!($One), "`] side by side; whole numbers by their bits.")]
        #[derive(Clone, Copy, Debug)]
        pub struct $Lanes<L: $crate::trace::simd::Lanes> {
            $(
                #[doc = concat!("As [`", stringify!($One), "::", stringify!($field), "`].")]
                pub $field: <$Type as $crate::trace::soa::Field>::Side<L>,
            )*
        }

        #[doc = concat!("Many of [`", stringify!($One), "`], column by column.")]
        #[derive(Clone, Debug, Default)]
        pub struct $Columns($crate::trace::soa::Columns<{ $One::COLUMNS }>);

        #[allow(dead_code, reason = "what is generated is the same for all work items, and none uses all of it")]
        const _: () = {
            use $crate::trace::simd::{LANES, Lanes};
            use $crate::trace::soa::Field;

            /// The first column of every field.
            struct Offsets {
                $( $field: usize, )*
            }

            impl $One {
                const COLUMNS: usize = 0 $( + <$Type as Field>::COLUMNS )*;
                #[allow(unused_assignments, reason = "the end of the last field is nobody's beginning")]
                const OFFSETS: Offsets = {
                    let mut end = 0;
                    Offsets {
                        $( $field: {
                            let at = end;
                            end += <$Type as Field>::COLUMNS;
                            at
                        }, )*
                    }
                };

                #[inline(always)]
                fn row(self) -> [f32; Self::COLUMNS] {
                    let mut row = [0.0; Self::COLUMNS];
                    $( self.$field.put(&mut row, Self::OFFSETS.$field); )*
                    row
                }

                #[inline(always)]
                fn of_row(row: &[f32; Self::COLUMNS]) -> Self {
                    $One { $( $field: Field::take(row, Self::OFFSETS.$field), )* }
                }
            }

            impl<L: Lanes> $Lanes<L> {
                #[inline(always)]
                fn rows(&self) -> [L; $One::COLUMNS] {
                    let mut rows = [L::splat(0.0); $One::COLUMNS];
                    $( <$Type as Field>::put_lanes(self.$field, &mut rows, $One::OFFSETS.$field); )*
                    rows
                }

                #[inline(always)]
                fn of_rows(rows: &[L; $One::COLUMNS]) -> Self {
                    $Lanes { $( $field: <$Type as Field>::take_lanes(rows, $One::OFFSETS.$field), )* }
                }

                /// The same in every lane.
                #[inline(always)]
                pub fn splat(one: $One) -> Self {
                    let mut rows = [L::splat(0.0); $One::COLUMNS];
                    for (lanes, x) in rows.iter_mut().zip(&one.row()) {
                        *lanes = L::splat(*x);
                    }
                    Self::of_rows(&rows)
                }
            }

            impl $Lanes<f32> {
                /// The one that is in the only lane.
                #[inline(always)]
                pub fn single(&self) -> $One {
                    $One::of_row(&self.rows())
                }
            }

            impl $Columns {
                /// Number of items.
                #[inline(always)]
                pub fn len(&self) -> usize {
                    self.0.len()
                }

                /// Whether there are none.
                #[inline(always)]
                pub fn is_empty(&self) -> bool {
                    self.0.is_empty()
                }

                /// Forgets all; memory stays.
                pub fn clear(&mut self) {
                    self.0.clear();
                }

                /// This many of them, whatever they are.
                pub fn set_len(&mut self, len: usize) {
                    self.0.set_len(len);
                }

                /// Adds one.
                #[inline(always)]
                pub fn push(&mut self, one: $One) {
                    self.0.push(one.row());
                }

                /// The one of this number.
                #[inline(always)]
                pub fn get(&self, i: usize) -> $One {
                    $One::of_row(&self.0.row(i))
                }

                /// Replaces the one of this number.
                #[inline(always)]
                pub fn set(&mut self, i: usize, one: $One) {
                    self.0.set(i, one.row());
                }

                /// The eight from number `i` on.
                #[inline(always)]
                pub fn lanes<L: Lanes>(&self, i: usize) -> $Lanes<L> {
                    $Lanes::of_rows(&self.0.rows(i))
                }

                /// Eight of them anywhere.
                #[inline(always)]
                pub fn gather<L: Lanes>(&self, numbers: &[usize; LANES]) -> $Lanes<L> {
                    $Lanes::of_rows(&self.0.gathered(numbers))
                }

                /// Overwrites the eight from number `i` on.
                #[inline(always)]
                pub fn store<L: Lanes>(&mut self, i: usize, lanes: &$Lanes<L>) {
                    self.0.store(i, &lanes.rows());
                }

                /// Adds those of the lanes that have a bit, in their order.
                #[inline(always)]
                pub fn compress_store<L: Lanes>(&mut self, which: u32, lanes: &$Lanes<L>) {
                    self.0.compress_store(which, &lanes.rows());
                }

                $(
                    #[doc = concat!("`", stringify!($field), "` of the eight from number `i` on.")]
                    #[inline(always)]
                    pub fn $field<L: Lanes>(&self, i: usize) -> <$Type as Field>::Side<L> {
                        let mut rows = [L::splat(0.0); $One::COLUMNS];
                        let first = $One::OFFSETS.$field;
                        for column in first..first + <$Type as Field>::COLUMNS {
                            rows[column] = self.0.eight(column, i);
                        }
                        <$Type as Field>::take_lanes(&rows, first)
                    }
                )*
            }
        };
    };
}
pub(in crate::trace) use work_item;
