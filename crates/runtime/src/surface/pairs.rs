//! Faces in pairs that share an edge: four corners to read and to add to instead of six.

use std::collections::HashMap;

/// The corners a, b, c, d of the faces (a, b, c) and (a, c, d); d is c where the first is alone: the
/// second then has no area.
pub(super) type FacePair = [u32; 4];

/// Each of `faces` in one pair.
pub(super) fn pairs(faces: &[[u32; 3]]) -> Vec<FacePair> {
    // By edge from one corner to another: a face that has it in this direction, and is not paired.
    let mut free: HashMap<(u32, u32), usize> = HashMap::new();
    let edges = |[a, b, c]: [u32; 3]| [(a, b), (b, c), (c, a)];
    for (index, face) in faces.iter().enumerate() {
        for edge in edges(*face) {
            free.insert(edge, index);
        }
    }
    let mut paired = vec![false; faces.len()];
    let mut pairs = Vec::with_capacity(faces.len() / 2 + 1);
    for (index, &[a, b, c]) in faces.iter().enumerate() {
        if paired[index] {
            continue;
        }
        paired[index] = true;
        let partner = [[a, b, c], [b, c, a], [c, a, b]]
            .into_iter()
            .find_map(|[a, b, c]| {
                // The other face has the edge from c to a the other way round.
                let other = *free.get(&(a, c))?;
                (!paired[other]).then_some((other, [a, b, c]))
            });
        pairs.push(match partner {
            Some((other, [a, b, c])) => {
                paired[other] = true;
                let third = faces[other]
                    .iter()
                    .find(|corner| **corner != a && **corner != c);
                [a, b, c, third.copied().unwrap_or(c)]
            }
            None => [a, b, c, c],
        });
    }
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The face, beginning with its least corner.
    fn turned([a, b, c]: [u32; 3]) -> [u32; 3] {
        let turns = [[a, b, c], [b, c, a], [c, a, b]];
        turns.into_iter().min().unwrap_or_default()
    }

    fn faces_of(pairs: &[FacePair]) -> Vec<[u32; 3]> {
        let both = pairs
            .iter()
            .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
        let faces = both.filter(|[_, b, c]| b != c);
        let mut faces: Vec<_> = faces.map(turned).collect();
        faces.sort_unstable();
        faces
    }

    #[test]
    fn every_face_is_in_one_pair_the_right_way_round() {
        let (width, height) = (5, 4);
        let at = |x: u32, y: u32| y * width + x;
        let mut faces = Vec::new();
        for y in 0..height - 1 {
            for x in 0..width - 1 {
                faces.push([at(x, y), at(x + 1, y), at(x, y + 1)]);
                faces.push([at(x, y + 1), at(x + 1, y), at(x + 1, y + 1)]);
            }
        }
        // One that has no neighbour, and one with the edge of another in the same direction.
        faces.push([100, 101, 102]);
        faces.push([at(0, 0), at(1, 0), 103]);
        let pairs = pairs(&faces);
        let mut expected: Vec<_> = faces.iter().copied().map(turned).collect();
        expected.sort_unstable();
        assert_eq!(faces_of(&pairs), expected);
        assert!(pairs.len() < 18, "{}", pairs.len());
    }

    #[test]
    fn a_face_without_area_is_left_alone() {
        assert_eq!(pairs(&[[1, 1, 2]]), [[1, 1, 2, 2]]);
        assert!(pairs(&[]).is_empty());
    }
}
