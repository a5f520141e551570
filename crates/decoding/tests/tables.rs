//! Tables, and what is refused.

use dynaskin_decoding::{BodyTexels, DecoderMatrix, DecodingError, Tables, WIDTH};

/// Two triangles over four vertices, of which two move.
fn matrix() -> DecoderMatrix<'static> {
    DecoderMatrix {
        vertex_count: 4,
        faces: &[0, 1, 2, 2, 1, 3],
        soft_vertices: &[1, 3],
        starts: &[0, 2, 3],
        latents: &[0, 1, 1],
        weights_m: &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0],
        latent_count: 2,
    }
}

#[test]
fn each_vertex_finds_its_weights_and_corners() {
    let tables = Tables::new(&matrix()).unwrap();
    assert_eq!(tables.vertices[0], [0, 0, 0, 1]);
    assert_eq!(tables.vertices[1], [0, 2, 1, 3]);
    assert_eq!(tables.vertices[2], [0, 0, 3, 5]);
    assert_eq!(tables.vertices[3], [2, 3, 5, 6]);
    assert_eq!(
        tables.weights[..3],
        [
            [1.0, 2.0, 3.0, 0.0],
            [4.0, 5.0, 6.0, 1.0],
            [7.0, 8.0, 9.0, 1.0],
        ]
    );
    // Turned so that the order of a face's corners, and with it the side of its normal, stays.
    assert_eq!(
        tables.corners[..6],
        [[1, 2], [2, 0], [3, 2], [0, 1], [1, 3], [2, 1]]
    );
}

#[test]
fn every_table_has_whole_rows() {
    let tables = Tables::new(&matrix()).unwrap();
    let none = DecoderMatrix {
        vertex_count: 0,
        faces: &[],
        soft_vertices: &[],
        starts: &[0],
        latents: &[],
        weights_m: &[],
        latent_count: 0,
    };
    let empty = Tables::new(&none).unwrap();
    for lengths in [tables, empty].map(|it| [it.vertices.len(), it.weights.len(), it.corners.len()])
    {
        assert_eq!(lengths, [WIDTH as usize; 3]);
    }
}

#[test]
fn controls_lie_at_the_soft_vertices() {
    let still = [0.0, 0.1, 0.2, 1.0, 1.1, 1.2, 2.0, 2.1, 2.2];
    let body = BodyTexels::new(&still, &[2], &[1.5], &[0.04]).unwrap();
    assert_eq!(body.still_positions[1], [1.0, 1.1, 1.2, 0.0]);
    assert_eq!(body.controls[..3], [[0.0, 0.0], [0.0, 0.0], [1.5, 0.04]]);
    assert_eq!(body.controls.len(), WIDTH as usize);
}

#[test]
fn wrong_numbers_are_refused() {
    let refused = |change: fn(&mut DecoderMatrix<'static>)| {
        let mut matrix = matrix();
        change(&mut matrix);
        Tables::new(&matrix).unwrap_err()
    };
    let what = |error: DecodingError| error.to_string();
    let cases = [
        (
            what(refused(|it| it.vertex_count = 3)),
            "faces is 3 at index 5, expected below 3",
        ),
        (
            what(refused(|it| it.faces = &[0, 1])),
            "faces has 2 values, expected 0",
        ),
        (
            what(refused(|it| it.soft_vertices = &[3, 1])),
            "soft vertices is 1 at index 1, expected at least 4",
        ),
        (
            what(refused(|it| it.soft_vertices = &[1])),
            "starts has 3 values, expected 2",
        ),
        (
            what(refused(|it| it.starts = &[0, 2, 1])),
            "starts is 1 at index 2, expected at least 2",
        ),
        (
            what(refused(|it| it.starts = &[0, 2, 2])),
            "the last of the starts is 2 at index 2, expected 0 to begin with, and the 3 weights at the end",
        ),
        (
            what(refused(|it| it.latent_count = 1)),
            "latents of the weights is 1 at index 1, expected below 1",
        ),
        (
            what(refused(|it| it.weights_m = &[f32::NAN; 9])),
            "weights holds NaN at index 0; every number must be finite",
        ),
    ];
    for (got, expected) in cases {
        assert_eq!(got, expected);
    }
    let body = |still: &[f32], soft: &[u32], gains: &[f32], limits: &[f32]| {
        BodyTexels::new(still, soft, gains, limits)
            .unwrap_err()
            .to_string()
    };
    assert_eq!(
        body(&[0.0; 4], &[], &[], &[]),
        "still positions has 4 values, expected 3"
    );
    assert_eq!(
        body(&[0.0; 3], &[1], &[1.0], &[1.0]),
        "soft vertices is 1 at index 0, expected below 1"
    );
    assert_eq!(
        body(&[0.0; 3], &[0], &[], &[1.0]),
        "gains has 0 values, expected 1"
    );
    assert_eq!(
        body(&[0.0; 3], &[0], &[1.0], &[f32::INFINITY]),
        "limits holds inf at index 0; every number must be finite"
    );
}
