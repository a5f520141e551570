//! The simulator against what is known of a slab of tissue on bone.

mod common;

use common::{SHEAR_PA, clip, plain_settings, slab, slab_shell};
use dynaskin_body::Pose;
use dynaskin_sim::{ClipLabels, Materials, Shell, SimError, SimSettings, Solver, simulate_clip};
use dynaskin_skeleton::GRAVITY_M_S2;
use glam::{DQuat, DVec3, Vec3};

fn mean_displacement_m(solver: &Solver<'_>) -> Vec3 {
    let all = solver.displacements_world_m();
    let count = all.len() as f32;
    all.sum::<Vec3>() / count
}

/// Frequency in hertz of free vibration in shear, from the upward zero crossings.
fn shear_frequency_hz(depth_m: f32, layers: u32) -> f64 {
    let settings = SimSettings {
        layers,
        ..plain_settings()
    };
    let shell = slab_shell(0.4, 0.0125, depth_m, &settings);
    let mut solver = Solver::new(&shell, &settings);
    solver.step(&Pose::REST).expect("stable");
    solver.set_state(|_, depth_share| {
        let height = (1.0 - depth_share) * std::f32::consts::FRAC_PI_2;
        (Vec3::ZERO, Vec3::X * (0.01 * height.sin()))
    });
    let mut before = 0.0_f64;
    let mut crossings = Vec::new();
    for tick in 0..180 {
        solver.step(&Pose::REST).expect("stable");
        let now = f64::from(mean_displacement_m(&solver).x);
        if before < 0.0 && now >= 0.0 {
            crossings.push((f64::from(tick) + before / (before - now)) / 60.0);
        }
        before = now;
    }
    assert!(crossings.len() > 3, "{crossings:?}");
    (crossings.len() - 1) as f64 / (crossings[crossings.len() - 1] - crossings[0])
}

#[test]
fn a_layer_vibrates_at_the_frequency_of_shear_waves() {
    for (depth_m, layers) in [(0.03, 2), (0.03, 4), (0.06, 2)] {
        let settings = plain_settings();
        let speed = f64::from(SHEAR_PA / settings.density_kg_per_m3).sqrt();
        let law_hz = speed / (4.0 * f64::from(depth_m));
        let got_hz = shear_frequency_hz(depth_m, layers);
        let error = got_hz / law_hz - 1.0;
        println!("{depth_m} m, {layers} layers: {got_hz:.3} Hz, law {law_hz:.3} Hz, {error:+.3}");
        assert!(
            error.abs() < 0.10,
            "{depth_m} m, {layers} layers: {got_hz} Hz, law {law_hz} Hz"
        );
    }
}

#[test]
fn a_slab_turned_on_its_side_sags_by_the_analytic_shear() {
    // Gravity along the layer: the surface of an infinite slab moves by rho g h² / (2 G), and as
    // gravity in the rest pose is already in the rest shape, turning adds its change on both axes.
    let depth_m = 0.02;
    let mut settings = plain_settings();
    for tissue in &mut settings.tissues {
        tissue.damping_ratio = 0.5;
    }
    let shell = slab_shell(0.4, 0.0125, depth_m, &settings);
    let mut pose = Pose::REST;
    pose.parent_from_joint[0] = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
    let mut solver = Solver::new(&shell, &settings);
    for _ in 0..120 {
        solver.step(&pose).unwrap();
    }
    // Down the slab is now its own -X: the rest-pose offset there is the sag.
    let middle = shell.vertices().len() / 2;
    let sag = solver.offsets_rest_m().nth(middle).unwrap();
    let expected =
        settings.density_kg_per_m3 * GRAVITY_M_S2 as f32 * depth_m * depth_m / (2.0 * SHEAR_PA);
    println!("sag {sag}, analytic {expected}");
    assert!(
        (sag.x / -expected - 1.0).abs() < 0.1,
        "{sag}, analytic {expected}"
    );
}

#[test]
fn zero_motion_gives_exactly_zero() {
    let settings = SimSettings::default();
    let shell = slab_shell(0.2, 0.02, 0.03, &settings);
    let mut solver = Solver::new(&shell, &settings);
    for _ in 0..30 {
        solver.step(&Pose::REST).expect("stable");
        assert!(solver.offsets_rest_m().all(|offset| offset == Vec3::ZERO));
    }
}

#[test]
fn undamped_energy_does_not_grow() {
    for (stiffening, skin_n_per_m) in [(0.0, 0.0), (0.5, 15.0)] {
        let mut settings = plain_settings();
        settings.stiffening = stiffening;
        for tissue in &mut settings.tissues {
            tissue.skin_n_per_m = skin_n_per_m;
        }
        let shell = slab_shell(0.2, 0.0125, 0.03, &settings);
        let mut solver = Solver::new(&shell, &settings);
        solver.step(&Pose::REST).expect("stable");
        let surface = slab(0.2, 0.0125, 0.03);
        solver.set_state(|vertex, depth_share| {
            let wave = (surface.positions_m[vertex as usize].x * 30.0).sin();
            (
                Vec3::ZERO,
                Vec3::new(0.4, 0.2 * wave, 0.1) * (1.0 - depth_share),
            )
        });
        let start = solver.energy_joules();
        let mut largest = 0.0_f64;
        let mut last_second = 0.0;
        for tick in 0..300 {
            solver.step(&Pose::REST).expect("stable");
            largest = largest.max(solver.energy_joules());
            if tick >= 240 {
                last_second += solver.energy_joules() / 60.0;
            }
        }
        println!("start {start} largest {largest} last second {last_second}");
        // Symplectic Euler's energy swings about the true one by O(dt), without drift.
        assert!(largest < start * 1.05, "grew from {start} to {largest}");
        assert!(
            (last_second / start - 1.0).abs() < 0.05,
            "{start} became {last_second}"
        );
    }
}

/// A hop with a twist, then a stop.
fn motion(place: impl Fn(Pose) -> Pose) -> Vec<Pose> {
    (0..90)
        .map(|tick| {
            let t = f64::from(tick) / 60.0;
            let fade = (1.0 - t).max(0.0);
            let mut pose = Pose::REST;
            pose.root_translation_m = DVec3::new(
                0.02 * (9.0 * t).sin(),
                0.05 * (15.0 * t).sin().powi(2),
                0.1 * t,
            ) * fade;
            pose.parent_from_joint[0] = DQuat::from_rotation_y(0.4 * (6.0 * t).sin() * fade)
                * DQuat::from_rotation_x(0.2 * (5.0 * t).sin() * fade);
            place(pose)
        })
        .collect()
}

fn offsets(shell: &Shell, settings: &SimSettings, poses: &[Pose]) -> Vec<Vec3> {
    let mut solver = Solver::new(shell, settings);
    let mut all = Vec::new();
    for pose in poses {
        solver.step(pose).expect("stable");
        all.extend(solver.offsets_rest_m());
    }
    all
}

fn largest_difference(a: &[Vec3], b: &[Vec3]) -> f32 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (*a - *b).length())
        .fold(0.0, f32::max)
}

#[test]
fn place_heading_and_constant_velocity_change_nothing() {
    let settings = SimSettings::default();
    let shell = slab_shell(0.2, 0.02, 0.03, &settings);
    let base = offsets(&shell, &settings, &motion(|pose| pose));
    let size = base.iter().map(|o| o.length()).fold(0.0, f32::max);
    assert!(size > 2e-3, "the motion must move the tissue, got {size} m");

    let moved = motion(|mut pose| {
        pose.root_translation_m += DVec3::new(10.0, 0.0, -4.0);
        pose
    });
    let turn = DQuat::from_rotation_y(1.3);
    let turned = motion(|mut pose| {
        pose.root_translation_m = turn * pose.root_translation_m;
        pose.parent_from_joint[0] = turn * pose.parent_from_joint[0];
        pose
    });
    let mut carried = motion(|pose| pose);
    for (tick, pose) in carried.iter_mut().enumerate() {
        pose.root_translation_m += DVec3::new(3.0, 0.5, 2.0) * (tick as f64 / 60.0);
    }
    for (name, poses) in [("moved", moved), ("turned", turned), ("carried", carried)] {
        let difference = largest_difference(&base, &offsets(&shell, &settings, &poses));
        println!("{name}: {difference} m of {size} m");
        assert!(difference < 1e-5, "{name}: {difference} m");
    }
}

#[test]
fn an_offset_needs_no_later_pose() {
    let settings = SimSettings::default();
    let shell = slab_shell(0.1, 0.02, 0.03, &settings);
    let poses = motion(|pose| pose);
    let whole = offsets(&shell, &settings, &poses);
    let part = offsets(&shell, &settings, &poses[..40]);
    assert_eq!(part[..], whole[..part.len()]);
}

#[test]
fn more_substeps_change_little() {
    let settings = SimSettings::default();
    let fine = SimSettings {
        substeps: 4 * settings.substeps,
        ..settings.clone()
    };
    let shell = slab_shell(0.2, 0.0125, 0.03, &settings);
    let poses = motion(|pose| pose);
    let (a, b) = (
        offsets(&shell, &settings, &poses),
        offsets(&shell, &fine, &poses),
    );
    let squares = |values: &[Vec3]| values.iter().map(|v| v.length_squared()).sum::<f32>();
    let difference: Vec<Vec3> = a.iter().zip(&b).map(|(a, b)| *a - *b).collect();
    let relative = (squares(&difference) / squares(&b)).sqrt();
    println!("RMS change with four times the steps: {relative}");
    assert!(relative < 0.05, "{relative}");
}

fn labels() -> ClipLabels {
    ClipLabels {
        name: "test".to_owned(),
        body_sha256: String::new(),
        seed: 1,
        shape: [0.0; 10],
        materials: Materials::NOMINAL,
        sim_json: "{}".to_owned(),
    }
}

#[test]
fn a_run_that_goes_astray_is_retried_then_reported() {
    // Far beyond the stable range: without mass scaling the first try must fail.
    let mut settings = plain_settings();
    settings.substeps = 4;
    settings.stability_limit = 1e3;
    let shell = slab_shell(0.1, 0.0125, 0.03, &settings);
    let frames = motion(|pose| pose);
    let done = simulate_clip(&shell, &clip("soft", frames.clone()), &settings, labels());
    let done = done.unwrap();
    assert!(done.substeps > settings.substeps, "{}", done.substeps);
    assert!(done.data.offsets_rest_m.iter().all(|x| x.is_finite()));

    for tissue in &mut settings.tissues {
        tissue.shear_modulus_pa = 1e6;
    }
    let shell = slab_shell(0.1, 0.0125, 0.03, &settings);
    let error = simulate_clip(&shell, &clip("hard", frames), &settings, labels()).unwrap_err();
    assert!(matches!(error, SimError::Unstable { .. }), "{error}");
    assert!(error.to_string().contains("hard"), "{error}");
}

#[test]
fn bad_clips_are_refused() {
    let settings = SimSettings::default();
    let shell = slab_shell(0.1, 0.02, 0.03, &settings);
    let run = |clip| simulate_clip(&shell, &clip, &settings, labels());
    assert!(matches!(
        run(clip("empty", Vec::new())),
        Err(SimError::BadPose { .. })
    ));
    let mut bad = Pose::REST;
    bad.root_translation_m.x = f64::NAN;
    let error = run(clip("nan", vec![Pose::REST, bad])).unwrap_err();
    assert!(error.to_string().contains("frame 1"), "{error}");
    let mut slow = clip("slow", vec![Pose::REST]);
    slow.rate_hz = 30.0;
    assert!(matches!(run(slow), Err(SimError::Rate { .. })));
}

#[test]
fn a_teleport_stays_finite_and_bounded() {
    let settings = SimSettings::default();
    let shell = slab_shell(0.1, 0.02, 0.05, &settings);
    let mut frames = motion(|pose| pose);
    frames[30].root_translation_m.y += 50.0;
    frames[50].parent_from_joint[0] = DQuat::from_rotation_x(3.0);
    let done = simulate_clip(&shell, &clip("flip", frames), &settings, labels()).unwrap();
    let largest = done
        .data
        .offsets_rest_m
        .iter()
        .map(|x| x.to_f32().abs())
        .fold(0.0, f32::max);
    assert!(largest < 0.1, "{largest} m");
}

#[test]
fn a_surface_without_soft_vertices_has_no_shell() {
    let mut surface = slab(0.1, 0.02, 0.03);
    for weights in &mut surface.region_weights {
        weights.fill(0.0);
    }
    assert!(Shell::new(&surface, &SimSettings::default()).is_none());
}
