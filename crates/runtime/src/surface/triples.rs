//! Lists of three numbers a vertex, read and written four numbers at once.

use glam::{Vec3A, Vec4};

/// The vector that begins at number `start` of a flat list. Four numbers are read, where there are
/// as many; the last belongs to the next vector.
#[inline(always)]
pub(super) fn load(list: &[f32], start: usize) -> Vec3A {
    match list.get(start..).and_then(|list| list.first_chunk::<4>()) {
        Some(numbers) => Vec3A::from_vec4(Vec4::from_array(*numbers)),
        None => Vec3A::from_slice(&list[start..]),
    }
}

/// Writes one vector after the other to a flat list, which has room for all. Four numbers are
/// written, where there is room, of which the next vector covers the last.
#[inline(always)]
pub(super) fn store_run(list: &mut [f32], vectors: impl Iterator<Item = Vec3A>) {
    for (index, vector) in vectors.enumerate() {
        let start = 3 * index;
        match list
            .get_mut(start..)
            .and_then(|list| list.first_chunk_mut::<4>())
        {
            Some(target) => *target = vector.extend(0.0).to_array(),
            None => vector.write_to_slice(&mut list[start..]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_stored_is_loaded_and_nothing_behind_it_changes() {
        let vectors = [Vec3A::new(1.0, 2.0, 3.0), Vec3A::new(-1.0, 0.5, 7.0)];
        let mut list = [9.0; 9];
        store_run(&mut list[..6], vectors.into_iter());
        assert_eq!(list, [1.0, 2.0, 3.0, -1.0, 0.5, 7.0, 9.0, 9.0, 9.0]);
        for (index, vector) in vectors.into_iter().enumerate() {
            assert_eq!(load(&list, 3 * index), vector);
            assert_eq!(load(&list[..6], 3 * index), vector);
        }
    }
}
