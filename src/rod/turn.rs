//! Strands' arrays into lanes and back: four strands by four numbers at a time are turned in registers,
//! so that a store takes four numbers and not one.

use super::block::{Lane, put3, take3};
use glam::{Mat4, Quat, Vec3};

/// Four strands' arrays of what a lane is filled from.
pub(crate) type Four<'a, T> = [&'a [T]; 4];

/// The same, to be written.
pub(crate) type FourMut<'a, T> = [&'a mut [T]; 4];

#[inline(always)]
fn turned(rows: [[f32; 4]; 4]) -> [[f32; 4]; 4] {
    Mat4::from_cols_array_2d(&rows).transpose().to_cols_array_2d()
}

#[inline(always)]
fn part(lane: &Lane, quarter: usize) -> [f32; 4] {
    lane.as_chunks().0[quarter % 4]
}

#[inline(always)]
fn part_mut(lane: &mut Lane, quarter: usize) -> &mut [f32; 4] {
    &mut lane.as_chunks_mut().0[quarter % 4]
}

/// Puts vectors into the lanes of a quarter of a block.
#[inline(always)]
pub(crate) fn put_vectors<T>(
    to: &mut [T],
    quarter: usize,
    from: Four<'_, Vec3>,
    field: impl Fn(&mut T) -> &mut [Lane; 3],
) {
    let from = from.map(|strand| &strand[..to.len()]);
    let fours = from.map(|strand| strand.as_chunks::<4>().0);
    let (chunks, rest) = to.as_chunks_mut::<4>();
    for (i, chunk) in chunks.iter_mut().enumerate() {
        // Four vectors of a strand are three times four numbers on end.
        let flat: [[[f32; 4]; 3]; 4] = fours.map(|strand| bytemuck::cast(strand[i]));
        for third in 0..3 {
            for (k, lanes) in turned(flat.map(|strand| strand[third])).into_iter().enumerate() {
                let number = 4 * third + k;
                *part_mut(&mut field(&mut chunk[number / 3])[number % 3], quarter) = lanes;
            }
        }
    }
    for (item, i) in rest.iter_mut().zip(4 * chunks.len()..) {
        for (k, strand) in from.iter().enumerate() {
            put3(field(item), 4 * (quarter % 4) + k, strand[i]);
        }
    }
}

/// Takes vectors out of the lanes of a quarter of a block.
#[inline(always)]
pub(crate) fn take_vectors<T>(
    from: &[T],
    quarter: usize,
    to: FourMut<'_, Vec3>,
    field: impl Fn(&T) -> &[Lane; 3],
) {
    let mut to = to.map(|strand| &mut strand[..from.len()]);
    let (chunks, rest) = from.as_chunks::<4>();
    for (i, chunk) in chunks.iter().enumerate() {
        let mut flat = [[[0.0; 4]; 3]; 4];
        for third in 0..3 {
            let rows = [0, 1, 2, 3].map(|k| {
                let number = 4 * third + k;
                part(&field(&chunk[number / 3])[number % 3], quarter)
            });
            for (strand, row) in flat.iter_mut().zip(turned(rows)) {
                strand[third] = row;
            }
        }
        for (strand, flat) in to.iter_mut().zip(flat) {
            strand.as_chunks_mut::<4>().0[i] = bytemuck::cast(flat);
        }
    }
    for (item, i) in rest.iter().zip(4 * chunks.len()..) {
        for (k, strand) in to.iter_mut().enumerate() {
            strand[i] = take3(field(item), 4 * (quarter % 4) + k);
        }
    }
}

/// Puts quaternions into the lanes of a quarter of a block.
#[inline(always)]
pub(crate) fn put_quaternions<T>(
    to: &mut [T],
    quarter: usize,
    from: Four<'_, Quat>,
    field: impl Fn(&mut T) -> &mut [Lane; 4],
) {
    let from = from.map(|strand| &strand[..to.len()]);
    for (i, item) in to.iter_mut().enumerate() {
        let lanes = turned(from.map(|strand| strand[i].to_array()));
        for (component, lanes) in field(item).iter_mut().zip(lanes) {
            *part_mut(component, quarter) = lanes;
        }
    }
}

/// Takes quaternions out of the lanes of a quarter of a block.
#[inline(always)]
pub(crate) fn take_quaternions<T>(
    from: &[T],
    quarter: usize,
    to: FourMut<'_, Quat>,
    field: impl Fn(&T) -> &[Lane; 4],
) {
    let mut to = to.map(|strand| &mut strand[..from.len()]);
    for (i, item) in from.iter().enumerate() {
        let rows = turned(field(item).each_ref().map(|component| part(component, quarter)));
        for (strand, row) in to.iter_mut().zip(rows) {
            strand[i] = Quat::from_array(row);
        }
    }
}

/// Puts numbers into the lanes of a quarter of a block.
#[inline(always)]
pub(crate) fn put_numbers<T>(
    to: &mut [T],
    quarter: usize,
    from: Four<'_, f32>,
    field: impl Fn(&mut T) -> &mut Lane,
) {
    let from = from.map(|strand| &strand[..to.len()]);
    let fours = from.map(|strand| strand.as_chunks::<4>().0);
    let (chunks, rest) = to.as_chunks_mut::<4>();
    for (i, chunk) in chunks.iter_mut().enumerate() {
        for (item, lanes) in chunk.iter_mut().zip(turned(fours.map(|strand| strand[i]))) {
            *part_mut(field(item), quarter) = lanes;
        }
    }
    for (item, i) in rest.iter_mut().zip(4 * chunks.len()..) {
        *part_mut(field(item), quarter) = from.map(|strand| strand[i]);
    }
}
