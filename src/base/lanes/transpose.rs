//! Strands' arrays into lanes and back: four strands by four numbers at a time are transposed in
//! registers, so that a store takes four numbers and not one.
//!
//! Arrays of four are written out: closures passed to `map` are not always inlined, which costs more
//! than everything else here.

use super::memory::{Lane, put3, take3};
use glam::{Mat4, Quat, Vec3};

/// Source arrays of four strands.
pub(crate) type Four<'a, T> = [&'a [T]; 4];

/// Target arrays of four strands.
pub(crate) type FourMut<'a, T> = [&'a mut [T]; 4];

/// Rows as columns.
#[inline(always)]
pub(crate) fn transposed(rows: [[f32; 4]; 4]) -> [[f32; 4]; 4] {
    Mat4::from_cols_array_2d(&rows).transpose().to_cols_array_2d()
}

#[inline(always)]
fn part(lane: &Lane, group: usize) -> [f32; 4] {
    lane.as_chunks().0[group % 4]
}

#[inline(always)]
fn part_mut(lane: &mut Lane, group: usize) -> &mut [f32; 4] {
    &mut lane.as_chunks_mut().0[group % 4]
}

/// Puts vectors into the lanes of a group of a block.
#[inline(always)]
pub(crate) fn put_vectors<T>(
    to: &mut [T],
    group: usize,
    from: Four<'_, Vec3>,
    field: impl Fn(&mut T) -> &mut [Lane; 3],
) {
    let from = from.map(|strand| &strand[..to.len()]);
    let fours = from.map(|strand| strand.as_chunks::<4>().0);
    let (chunks, rest) = to.as_chunks_mut::<4>();
    for (i, chunk) in chunks.iter_mut().enumerate() {
        // Four vectors of a strand are three groups of four contiguous numbers.
        let [a, b, c, d] = &fours;
        let [a, b, c, d]: [[[f32; 4]; 3]; 4] = [
            bytemuck::cast(a[i]),
            bytemuck::cast(b[i]),
            bytemuck::cast(c[i]),
            bytemuck::cast(d[i]),
        ];
        for third in 0..3 {
            let rows = [a[third], b[third], c[third], d[third]];
            for (k, lanes) in transposed(rows).into_iter().enumerate() {
                let number = 4 * third + k;
                *part_mut(&mut field(&mut chunk[number / 3])[number % 3], group) = lanes;
            }
        }
    }
    for (item, i) in rest.iter_mut().zip(4 * chunks.len()..) {
        for (k, strand) in from.iter().enumerate() {
            put3(field(item), 4 * (group % 4) + k, strand[i]);
        }
    }
}

/// Takes vectors out of the lanes of a group of a block.
#[inline(always)]
pub(crate) fn take_vectors<T>(
    from: &[T],
    group: usize,
    to: FourMut<'_, Vec3>,
    field: impl Fn(&T) -> &[Lane; 3],
) {
    let mut to = to.map(|strand| &mut strand[..from.len()]);
    let (chunks, rest) = from.as_chunks::<4>();
    for (i, chunk) in chunks.iter().enumerate() {
        let mut flat = [[[0.0; 4]; 3]; 4];
        for third in 0..3 {
            let mut rows = [[0.0; 4]; 4];
            for (row, number) in rows.iter_mut().zip(4 * third..) {
                *row = part(&field(&chunk[number / 3])[number % 3], group);
            }
            for (strand, row) in flat.iter_mut().zip(transposed(rows)) {
                strand[third] = row;
            }
        }
        for (strand, flat) in to.iter_mut().zip(flat) {
            strand.as_chunks_mut::<4>().0[i] = bytemuck::cast(flat);
        }
    }
    for (item, i) in rest.iter().zip(4 * chunks.len()..) {
        for (k, strand) in to.iter_mut().enumerate() {
            strand[i] = take3(field(item), 4 * (group % 4) + k);
        }
    }
}

/// Puts quaternions into the lanes of a group of a block.
#[inline(always)]
pub(crate) fn put_quaternions<T>(
    to: &mut [T],
    group: usize,
    from: Four<'_, Quat>,
    field: impl Fn(&mut T) -> &mut [Lane; 4],
) {
    let from = from.map(|strand| &strand[..to.len()]);
    for (i, item) in to.iter_mut().enumerate() {
        let [a, b, c, d] = &from;
        let rows = [a[i].to_array(), b[i].to_array(), c[i].to_array(), d[i].to_array()];
        let lanes = transposed(rows);
        for (component, lanes) in field(item).iter_mut().zip(lanes) {
            *part_mut(component, group) = lanes;
        }
    }
}

/// Takes quaternions out of the lanes of a group of a block.
#[inline(always)]
pub(crate) fn take_quaternions<T>(
    from: &[T],
    group: usize,
    to: FourMut<'_, Quat>,
    field: impl Fn(&T) -> &[Lane; 4],
) {
    let mut to = to.map(|strand| &mut strand[..from.len()]);
    for (i, item) in from.iter().enumerate() {
        let [x, y, z, w] = field(item);
        let lanes = [part(x, group), part(y, group), part(z, group), part(w, group)];
        for (strand, row) in to.iter_mut().zip(transposed(lanes)) {
            strand[i] = Quat::from_array(row);
        }
    }
}

/// Puts numbers into the lanes of a group of a block.
#[inline(always)]
pub(crate) fn put_numbers<T>(
    to: &mut [T],
    group: usize,
    from: Four<'_, f32>,
    field: impl Fn(&mut T) -> &mut Lane,
) {
    let from = from.map(|strand| &strand[..to.len()]);
    let fours = from.map(|strand| strand.as_chunks::<4>().0);
    let (chunks, rest) = to.as_chunks_mut::<4>();
    for (i, chunk) in chunks.iter_mut().enumerate() {
        let [a, b, c, d] = &fours;
        for (item, lanes) in chunk.iter_mut().zip(transposed([a[i], b[i], c[i], d[i]])) {
            *part_mut(field(item), group) = lanes;
        }
    }
    for (item, i) in rest.iter_mut().zip(4 * chunks.len()..) {
        let [a, b, c, d] = &from;
        *part_mut(field(item), group) = [a[i], b[i], c[i], d[i]];
    }
}

/// Takes numbers out of the lanes of a group of a block.
#[inline(always)]
pub(crate) fn take_numbers<T>(
    from: &[T],
    group: usize,
    to: FourMut<'_, f32>,
    field: impl Fn(&T) -> &Lane,
) {
    let [a, b, c, d] = to.map(|strand| &mut strand[..from.len()]);
    let (chunks, rest) = from.as_chunks::<4>();
    for (i, chunk) in chunks.iter().enumerate() {
        let [w, x, y, z] = chunk;
        let lanes = [
            part(field(w), group),
            part(field(x), group),
            part(field(y), group),
            part(field(z), group),
        ];
        let [p, q, r, s] = transposed(lanes);
        a.as_chunks_mut::<4>().0[i] = p;
        b.as_chunks_mut::<4>().0[i] = q;
        c.as_chunks_mut::<4>().0[i] = r;
        d.as_chunks_mut::<4>().0[i] = s;
    }
    for (item, i) in rest.iter().zip(4 * chunks.len()..) {
        [a[i], b[i], c[i], d[i]] = part(field(item), group);
    }
}

#[cfg(test)]
mod tests {
    use super::super::LANES;
    use super::*;

    #[derive(Clone, Copy, Default)]
    struct Item {
        vector: [Lane; 3],
        quaternion: [Lane; 4],
        number: Lane,
    }

    #[test]
    fn values_put_into_a_lane_group_come_back_for_any_length() {
        for length in 1..=13 {
            let value =
                |strand: usize, i: usize, part: usize| (100 * strand + 10 * i + part) as f32;
            let make = |strand: usize| {
                let vector = |i| Vec3::from_array([0, 1, 2].map(|part| value(strand, i, part)));
                let quaternion =
                    |i| Quat::from_array([3, 4, 5, 6].map(|part| value(strand, i, part)));
                let all = 0..length;
                (
                    all.clone().map(vector).collect::<Vec<_>>(),
                    all.clone().map(quaternion).collect::<Vec<_>>(),
                    all.map(|i| value(strand, i, 7)).collect::<Vec<_>>(),
                )
            };
            for group in 0..4 {
                let strands = [0, 1, 2, 3].map(make);
                let mut items = vec![Item::default(); length];
                put_vectors(&mut items, group, strands.each_ref().map(|s| &s.0[..]), |item| {
                    &mut item.vector
                });
                put_quaternions(&mut items, group, strands.each_ref().map(|s| &s.1[..]), |item| {
                    &mut item.quaternion
                });
                put_numbers(&mut items, group, strands.each_ref().map(|s| &s.2[..]), |item| {
                    &mut item.number
                });
                for (i, item) in items.iter().enumerate() {
                    for lane in 0..LANES {
                        let rows = item.vector.iter().chain(&item.quaternion).chain([&item.number]);
                        for (part, row) in rows.enumerate() {
                            let inside = (4 * group..4 * group + 4).contains(&lane);
                            let expected =
                                if inside { value(lane - 4 * group, i, part) } else { 0.0 };
                            assert_eq!(row[lane], expected, "{length}, {group}, {lane}, {part}");
                        }
                    }
                }
                let mut back = [0; 4].map(|_| {
                    (vec![Vec3::NAN; length], vec![Quat::NAN; length], vec![f32::NAN; length])
                });
                let [a, b, c, d] = &mut back;
                let numbers = [&mut a.2[..], &mut b.2, &mut c.2, &mut d.2];
                take_numbers(&items, group, numbers, |item| &item.number);
                let vectors = [&mut a.0[..], &mut b.0, &mut c.0, &mut d.0];
                take_vectors(&items, group, vectors, |item| &item.vector);
                let quaternions = [&mut a.1[..], &mut b.1, &mut c.1, &mut d.1];
                take_quaternions(&items, group, quaternions, |item| &item.quaternion);
                for (back, strand) in back.iter().zip(&strands) {
                    assert_eq!((&back.0, &back.1, &back.2), (&strand.0, &strand.1, &strand.2));
                }
            }
        }
    }
}
