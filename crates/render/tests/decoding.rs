//! Surfaces decoded on the card are those of the runtime: positions and normals read back, and pictures.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

mod common;

use std::path::Path;
use std::sync::Arc;

use common::{mean_difference, picture, renderer};
use dynaskin_body::Pose;
use dynaskin_motion::{Clip, Procedural, ProceduralKind};
use dynaskin_render::{
    BodyId, BodyMesh, DecoderId, DecoderMatrix, Look, OffsetSizes, RenderError, Renderer,
    SkinningPath,
};
use dynaskin_runtime::{Avatar, Controls, Decoding, Detail, Model};
use glam::Vec3;

/// What is asked of the renderer, in metres.
const TOLERANCE_M: f32 = 1e-4;
/// Between unit normals.
const NORMAL_TOLERANCE: f32 = 1e-3;

const PATHS: [SkinningPath; 2] = [SkinningPath::Compute, SkinningPath::VertexStage];

fn model(name: &str) -> Arc<Model> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../models")
        .join(name);
    let mut read = |file: &str| std::fs::read(folder.join(file)).map_err(|e| e.to_string());
    let bundle = read("bundle.json").unwrap();
    Arc::new(Model::load(&bundle, &mut read).unwrap())
}

fn clip(kind: ProceduralKind, avatar: &Avatar) -> Clip {
    let mut motion = Procedural::new(kind);
    motion.duration_seconds = 5.0;
    motion.clip(avatar.joints_rest_m()).unwrap()
}

/// The pose of a tick.
fn pose(clip: &Clip, tick: usize) -> Pose {
    clip.pose_at((0.5 + tick as f64 / 60.0) % clip.duration_seconds())
}

fn flat(vectors: &[Vec3]) -> Vec<f32> {
    vectors.iter().flat_map(Vec3::to_array).collect()
}

fn add_decoder(renderer: &mut Renderer, model: &Model) -> DecoderId {
    let decoder = model.linear_decoder().unwrap();
    let matrix = DecoderMatrix {
        vertex_count: model.body().vertex_count(),
        faces: model.body().faces.as_flattened(),
        soft_vertices: model.soft_vertices(),
        starts: decoder.starts(),
        latents: decoder.latents(),
        weights_m: decoder.weights().as_flattened(),
        latent_count: decoder.latent_count(),
    };
    renderer.add_decoder(&matrix).unwrap()
}

fn add_body(renderer: &mut Renderer, model: &Model) -> BodyId {
    let body = model.body();
    let joints: Vec<u8> = body.skin.iter().flat_map(|skin| skin.joints).collect();
    let weights: Vec<f32> = body.skin.iter().flat_map(|skin| skin.weights).collect();
    let mesh = BodyMesh {
        faces: body.faces.as_flattened(),
        skin_joints: &joints,
        skin_weights: &weights,
        colors_srgba: body.colors_srgba.as_flattened(),
    };
    renderer.add_body(&mesh).unwrap()
}

/// Tells the renderer what does not change with every step.
fn decode_body(renderer: &mut Renderer, id: BodyId, decoder: DecoderId, avatar: &Avatar) {
    let still_m = flat(avatar.still_positions_rest_m());
    let (gains, limits_m) = (avatar.vertex_gains(), avatar.vertex_limits_m());
    renderer
        .decode_body(id, decoder, &still_m, gains, limits_m)
        .unwrap();
}

fn show(renderer: &mut Renderer, id: BodyId, avatar: &Avatar) {
    renderer
        .set_latents(id, avatar.undecoded_latents().unwrap())
        .unwrap();
    renderer
        .set_skin_matrices(id, avatar.skin_matrices())
        .unwrap();
}

/// As [`show`] with the surface that the runtime has decoded.
fn show_from_cpu(renderer: &mut Renderer, id: BodyId, avatar: &mut Avatar) {
    avatar.update_surface();
    let (positions_m, normals) = (flat(avatar.positions_rest_m()), flat(avatar.normals_rest()));
    let offsets_m = flat(avatar.offsets_rest_m());
    let offsets = OffsetSizes::Vectors(&offsets_m);
    renderer
        .set_surface(id, &positions_m, &normals, offsets)
        .unwrap();
    renderer
        .set_skin_matrices(id, avatar.skin_matrices())
        .unwrap();
}

fn on_demand(model: &Arc<Model>, shape: &[f32; 10]) -> Avatar {
    let mut avatar = Avatar::new(Arc::clone(model), shape).unwrap();
    avatar.set_decoding(Decoding::OnDemand);
    avatar
}

fn largest_difference(a: &[f32], b: &[Vec3]) -> f32 {
    assert_eq!(a.len(), 3 * b.len());
    let pairs = a.as_chunks::<3>().0.iter().zip(b);
    pairs
        .map(|(a, b)| Vec3::from(*a).distance(*b))
        .fold(0.0, f32::max)
}

/// Reads a body back and holds it to the runtime; gives the largest offset.
fn assert_same(renderer: &mut Renderer, id: BodyId, avatar: &mut Avatar, what: &str) -> f32 {
    let reading = renderer.read_decoded(id).unwrap();
    let [positions_m, normals] = pollster::block_on(reading).unwrap();
    avatar.update_surface();
    let apart_m = largest_difference(&positions_m, avatar.positions_rest_m());
    let turned = largest_difference(&normals, avatar.normals_rest());
    assert!(apart_m <= TOLERANCE_M, "{what}: {apart_m} m");
    assert!(turned <= NORMAL_TOLERANCE, "{what}: {turned}");
    let lengths = avatar.offsets_rest_m().iter().map(|offset| offset.length());
    lengths.fold(0.0, f32::max)
}

#[test]
fn cards_decode_as_the_runtime_does() {
    for path in PATHS {
        let test = "cards_decode_as_the_runtime_does";
        let Some(mut renderer) = renderer(test, path) else {
            return;
        };
        for name in ["female", "male"] {
            let model = model(name);
            let decoder = add_decoder(&mut renderer, &model);
            let id = add_body(&mut renderer, &model);
            let shape = std::array::from_fn(|idx| 1.5 - 0.3 * idx as f32);
            let mut avatar = on_demand(&model, &shape);
            decode_body(&mut renderer, id, decoder, &avatar);
            let clip = clip(ProceduralKind::Hop, &avatar);
            let mut largest_m = 0.0_f32;
            for tick in 0..60 {
                if tick == 40 {
                    // Offsets twice as large, most of them beyond what their limits leave alone.
                    let mut controls = Controls::default();
                    controls.strength = 2.0;
                    for region in &mut controls.regions {
                        region.gain = 0.8;
                        region.limit_m = 0.03;
                    }
                    avatar.set_controls(&controls).unwrap();
                    decode_body(&mut renderer, id, decoder, &avatar);
                }
                avatar.step(&pose(&clip, tick), 1.0 / 60.0).unwrap();
                show(&mut renderer, id, &avatar);
                if tick % 4 == 3 {
                    let what = format!("{path:?}, {name}, tick {tick}");
                    let offset_m = assert_same(&mut renderer, id, &mut avatar, &what);
                    largest_m = largest_m.max(offset_m);
                }
            }
            println!("{path:?}, {name}: offsets up to {largest_m} m");
            assert!(largest_m > 0.02, "{largest_m}");
        }
    }
}

#[test]
fn at_rest_a_surface_is_exactly_the_one_at_rest() {
    for path in PATHS {
        let test = "at_rest_a_surface_is_exactly_the_one_at_rest";
        let Some(mut renderer) = renderer(test, path) else {
            return;
        };
        let model = model("female");
        let decoder = add_decoder(&mut renderer, &model);
        let id = add_body(&mut renderer, &model);
        let mut avatar = on_demand(&model, &[0.5; 10]);
        decode_body(&mut renderer, id, decoder, &avatar);
        let clip = clip(ProceduralKind::Hop, &avatar);
        let is_at_rest = |renderer: &mut Renderer, avatar: &Avatar| {
            let reading = renderer.read_decoded(id).unwrap();
            let [positions_m, _] = pollster::block_on(reading).unwrap();
            positions_m == flat(avatar.still_positions_rest_m())
        };
        show(&mut renderer, id, &avatar);
        assert!(is_at_rest(&mut renderer, &avatar), "before the first step");
        for tick in 0..40 {
            avatar.step(&pose(&clip, tick), 1.0 / 60.0).unwrap();
        }
        show(&mut renderer, id, &avatar);
        assert!(!is_at_rest(&mut renderer, &avatar), "in a hop");
        avatar.set_detail(Detail::Asleep);
        for tick in 40..60 {
            avatar.step(&pose(&clip, tick), 1.0 / 60.0).unwrap();
        }
        show(&mut renderer, id, &avatar);
        assert!(is_at_rest(&mut renderer, &avatar), "asleep");
    }
}

#[test]
fn bodies_of_a_decoder_do_not_disturb_each_other() {
    for path in PATHS {
        let test = "bodies_of_a_decoder_do_not_disturb_each_other";
        let Some(mut renderer) = renderer(test, path) else {
            return;
        };
        let model = model("female");
        let decoder = add_decoder(&mut renderer, &model);
        let mut bodies: Vec<(BodyId, Avatar)> = Vec::new();
        let add = |renderer: &mut Renderer, number: usize| {
            let shape = std::array::from_fn(|idx| ((number * 7 + idx * 3) as f32).sin());
            let id = add_body(renderer, &model);
            let avatar = on_demand(&model, &shape);
            decode_body(renderer, id, decoder, &avatar);
            (id, avatar)
        };
        // As many as fill pools of one, two and four, and more.
        for number in 0..9 {
            bodies.push(add(&mut renderer, number));
        }
        let clip = clip(ProceduralKind::RunInPlace, &bodies[0].1);
        let shown = |renderer: &mut Renderer, bodies: &mut [(BodyId, Avatar)], from: usize| {
            for (number, (id, avatar)) in bodies.iter_mut().enumerate() {
                for tick in from..from + 10 {
                    avatar
                        .step(&pose(&clip, tick + 3 * number), 1.0 / 60.0)
                        .unwrap();
                }
                // The others stay as they were.
                if (number + from).is_multiple_of(2) || from == 0 {
                    show(renderer, *id, avatar);
                    let what = format!("{path:?}, body {number}");
                    assert_same(renderer, *id, avatar, &what);
                }
            }
        };
        shown(&mut renderer, &mut bodies, 0);
        shown(&mut renderer, &mut bodies, 11);
        // Two go, two others take their places.
        for index in [6, 2] {
            let (id, _) = bodies.remove(index);
            renderer.remove_body(id).unwrap();
        }
        for number in 20..22 {
            bodies.push(add(&mut renderer, number));
        }
        for (id, avatar) in &mut bodies {
            avatar.step(&pose(&clip, 90), 1.0 / 60.0).unwrap();
            show(&mut renderer, *id, avatar);
        }
        for (number, (id, avatar)) in bodies.iter_mut().enumerate() {
            assert_same(
                &mut renderer,
                *id,
                avatar,
                &format!("{path:?}, then {number}"),
            );
        }
    }
}

#[test]
fn pictures_are_the_same_whoever_decodes() {
    for path in PATHS {
        let test = "pictures_are_the_same_whoever_decodes";
        let Some(mut renderer) = renderer(test, path) else {
            return;
        };
        let model = model("female");
        let decoder = add_decoder(&mut renderer, &model);
        let id = add_body(&mut renderer, &model);
        let mut avatar = on_demand(&model, &[1.0; 10]);
        let clip = clip(ProceduralKind::Hop, &avatar);
        for tick in 0..50 {
            avatar.step(&pose(&clip, tick), 1.0 / 60.0).unwrap();
        }
        // The clothes are cut by the first surface that a body gets.
        decode_body(&mut renderer, id, decoder, &avatar);
        for heat_range_mm in [None, Some(40.0)] {
            renderer.set_heat_map(heat_range_mm).unwrap();
            show(&mut renderer, id, &avatar);
            let decoded = picture(&mut renderer);
            show_from_cpu(&mut renderer, id, &mut avatar);
            let uploaded = picture(&mut renderer);
            let difference = mean_difference(&decoded, &uploaded);
            println!("{path:?}, heat {heat_range_mm:?}: {difference} of 255");
            assert!(difference < 0.05, "{path:?}: {difference}");
            // Both in one frame: the last one counts.
            show(&mut renderer, id, &avatar);
            show_from_cpu(&mut renderer, id, &mut avatar);
            assert_eq!(mean_difference(&picture(&mut renderer), &uploaded), 0.0);
            show_from_cpu(&mut renderer, id, &mut avatar);
            show(&mut renderer, id, &avatar);
            assert_eq!(mean_difference(&picture(&mut renderer), &decoded), 0.0);
            // A picture of nothing would prove nothing.
            renderer.set_body_visible(id, false).unwrap();
            assert!(mean_difference(&picture(&mut renderer), &decoded) > 2.0);
            renderer.set_body_visible(id, true).unwrap();
        }
    }
}

#[test]
fn what_cannot_be_decoded_is_refused_and_nothing_changes() {
    let test = "what_cannot_be_decoded_is_refused_and_nothing_changes";
    let Some(mut renderer) = renderer(test, SkinningPath::Compute) else {
        return;
    };
    let model = model("female");
    let id = add_body(&mut renderer, &model);
    let avatar = on_demand(&model, &[0.0; 10]);
    let latents = avatar.undecoded_latents().unwrap();
    assert!(matches!(
        renderer.set_latents(id, latents),
        Err(RenderError::NotDecoded { .. })
    ));
    let still_m = flat(avatar.still_positions_rest_m());
    let (gains, limits_m) = (avatar.vertex_gains(), avatar.vertex_limits_m());
    let unknown = DecoderId::from_index(7);
    assert_eq!(
        renderer.decode_body(id, unknown, &still_m, gains, limits_m),
        Err(RenderError::UnknownDecoder { id: 7 })
    );
    let decoder = add_decoder(&mut renderer, &model);
    assert_eq!(
        renderer.decode_body(id, unknown, &still_m, gains, limits_m),
        Err(RenderError::UnknownDecoder { id: 7 })
    );
    for (still_m, gains) in [(&still_m[3..], gains), (&still_m[..], &gains[1..])] {
        let refused = renderer.decode_body(id, decoder, still_m, gains, limits_m);
        assert!(matches!(refused, Err(RenderError::WrongLength { .. })));
    }
    decode_body(&mut renderer, id, decoder, &avatar);
    show(&mut renderer, id, &avatar);
    let refused = renderer.set_latents(id, &latents[1..]);
    assert!(matches!(refused, Err(RenderError::WrongLength { .. })));
    let wrong = vec![f32::NAN; latents.len()];
    let refused = renderer.set_latents(id, &wrong);
    assert!(matches!(refused, Err(RenderError::NonFinite { .. })));
    let draped = Look {
        draped: true,
        ..Look::default()
    };
    renderer.set_look(id, draped).unwrap();
    let refused = renderer.set_latents(id, latents);
    assert!(matches!(refused, Err(RenderError::DrapedDecoding { .. })));
    renderer.set_look(id, Look::default()).unwrap();

    let matrix = DecoderMatrix {
        vertex_count: 4,
        faces: &[0, 1, 2, 2, 1, 3],
        soft_vertices: &[1, 3],
        starts: &[0, 1, 3],
        latents: &[0, 0, 1],
        weights_m: &[0.1; 9],
        latent_count: 2,
    };
    renderer.add_decoder(&matrix).unwrap();
    let broken = [
        DecoderMatrix {
            faces: &[0, 1, 4],
            ..matrix
        },
        DecoderMatrix {
            faces: &[0, 1],
            ..matrix
        },
        DecoderMatrix {
            soft_vertices: &[3, 1],
            ..matrix
        },
        DecoderMatrix {
            soft_vertices: &[1, 4],
            ..matrix
        },
        DecoderMatrix {
            soft_vertices: &[1],
            ..matrix
        },
        DecoderMatrix {
            starts: &[0, 4, 3],
            ..matrix
        },
        DecoderMatrix {
            starts: &[1, 2, 3],
            ..matrix
        },
        DecoderMatrix {
            starts: &[0, 1, 2],
            ..matrix
        },
        DecoderMatrix {
            latents: &[0, 0, 2],
            ..matrix
        },
        DecoderMatrix {
            weights_m: &[f32::INFINITY; 9],
            ..matrix
        },
        DecoderMatrix {
            weights_m: &[0.1; 8],
            ..matrix
        },
    ];
    for matrix in broken {
        assert!(renderer.add_decoder(&matrix).is_err(), "{matrix:?}");
    }
    // A body of another mesh.
    let small = renderer.add_decoder(&matrix).unwrap();
    let refused = renderer.decode_body(id, small, &[0.0; 12], &[1.0; 2], &[0.1; 2]);
    assert!(matches!(refused, Err(RenderError::WrongLength { .. })));
    let reading = renderer.read_decoded(id).unwrap();
    let [positions_m, _] = pollster::block_on(reading).unwrap();
    assert_eq!(positions_m, still_m);
}
