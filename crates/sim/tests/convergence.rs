//! The simulator against finer versions of itself and against what tissue must do at large strain.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

mod common;

use common::{SHEAR_PA, plain_settings, slab, slab_shell};
use dynaskin_body::Pose;
use dynaskin_sim::{Shell, SimSettings, Solver};
use glam::Vec3;

/// Shaking sideways and up and down as in running, then a stop.
fn shaken(tick: u32) -> Pose {
    let t = f64::from(tick) / 60.0;
    let on = (1.0 - (t - 1.0).max(0.0) * 4.0).clamp(0.0, 1.0);
    let mut pose = Pose::REST;
    pose.root_translation_m.x = 0.03 * (12.0 * t).sin() * on;
    pose.root_translation_m.y = 0.04 * (17.0 * t).sin() * on;
    pose
}

/// Displacements at the corners of a grid of `spacing_m` in the slab's middle, tick by tick.
fn sampled(spacing_m: f32, settings: &SimSettings) -> Vec<Vec3> {
    let (width_m, grid_m) = (0.2, 0.025);
    let surface = slab(width_m, spacing_m, 0.03);
    let shell = Shell::new(&surface, settings).unwrap();
    let slots: Vec<usize> = shell
        .vertices()
        .iter()
        .enumerate()
        .filter(|(_, vertex)| {
            let p = surface.positions_m[**vertex as usize];
            [p.x, p.z].into_iter().all(|at| {
                let cells = at / grid_m;
                (cells - cells.round()).abs() < 1e-3 && (at - width_m / 2.0).abs() < 0.06
            })
        })
        .map(|(slot, _)| slot)
        .collect();
    assert_eq!(slots.len(), 25, "the same points of every mesh");
    let mut solver = Solver::new(&shell, settings);
    let mut all = Vec::new();
    for tick in 0..90 {
        solver.step(&shaken(tick)).unwrap();
        let now: Vec<Vec3> = solver.displacements_world_m().collect();
        all.extend(slots.iter().map(|slot| now[*slot]));
    }
    all
}

fn relative_rms(a: &[Vec3], b: &[Vec3]) -> f32 {
    assert_eq!(a.len(), b.len());
    let difference: f32 = a
        .iter()
        .zip(b)
        .map(|(a, b)| (*a - *b).length_squared())
        .sum();
    (difference / b.iter().map(|v| v.length_squared()).sum::<f32>()).sqrt()
}

#[test]
fn halving_the_time_step_changes_little() {
    let settings = SimSettings::default();
    let fine = SimSettings {
        substeps: 2 * settings.substeps,
        ..settings.clone()
    };
    let change = relative_rms(&sampled(0.0125, &settings), &sampled(0.0125, &fine));
    println!("RMS change with half the time step: {change:.4}");
    assert!(change < 0.05, "{change}");
}

#[test]
fn halving_the_elements_changes_little() {
    let settings = SimSettings::default();
    // The same real mass: finer elements need smaller steps for it.
    let fine = SimSettings {
        layers: 2 * settings.layers,
        substeps: 2 * settings.substeps,
        ..settings.clone()
    };
    let coarse = sampled(0.0125, &settings);
    let layers = relative_rms(&coarse, &sampled(0.0125, &fine));
    let both = relative_rms(&coarse, &sampled(0.00625, &fine));
    println!("RMS change: half as thick layers {layers:.4}, and half as wide elements {both:.4}");
    assert!(both < 0.05, "{both}");
}

/// Steady sideways displacement of a 6 cm deep slab under a constant acceleration.
fn carried_m(acceleration_m_per_s2: f64, stiffening: f32) -> f32 {
    let mut settings = plain_settings();
    settings.stiffening = stiffening;
    for tissue in &mut settings.tissues {
        tissue.damping_ratio = 0.6;
    }
    let shell = slab_shell(0.4, 0.025, 0.06, &settings);
    let mut solver = Solver::new(&shell, &settings);
    for tick in 0..150 {
        let t = f64::from(tick) / 60.0;
        let mut pose = Pose::REST;
        pose.root_translation_m.x = acceleration_m_per_s2 * t * t / 2.0;
        solver.step(&pose).unwrap();
    }
    let middle = shell.vertices().len() / 2;
    solver.displacements_world_m().nth(middle).unwrap().x.abs()
}

#[test]
fn twice_the_acceleration_moves_large_strain_less_than_twice_as_far() {
    let stiffening = SimSettings::default().stiffening;
    let [small, half, full] = [1.0, 10.0, 20.0].map(|a| carried_m(a, stiffening));
    let law_m = 950.0 * 0.06 * 0.06 / (2.0 * SHEAR_PA);
    println!(
        "1, 10, 20 m/s²: {small} m (linear law {law_m} m), {half} m, {full} m; ratio {:.2}",
        full / half
    );
    assert!(
        (small / law_m - 1.0).abs() < 0.15,
        "small strain is linear: {small} {law_m}"
    );
    assert!(half > 0.012, "the strain is large: {half} m of 0.06 m");
    assert!(full / half < 1.8, "{full} / {half}");
}

#[test]
fn free_vibration_decays_as_the_damping_ratio_says() {
    let mut settings = plain_settings();
    for tissue in &mut settings.tissues {
        tissue.damping_ratio = 0.1;
    }
    let shell = slab_shell(0.4, 0.0125, 0.06, &settings);
    let mut solver = Solver::new(&shell, &settings);
    solver.step(&Pose::REST).unwrap();
    solver.set_state(|_, depth_share| {
        let height = (1.0 - depth_share) * std::f32::consts::FRAC_PI_2;
        (Vec3::X * (0.005 * height.sin()), Vec3::ZERO)
    });
    let middle = shell.vertices().len() / 2;
    let mut trace = vec![0.005_f32];
    for _ in 0..90 {
        solver.step(&Pose::REST).unwrap();
        trace.push(solver.displacements_world_m().nth(middle).unwrap().x);
    }
    let peaks: Vec<f32> = trace
        .windows(3)
        .filter(|w| w[1] > w[0] && w[1] >= w[2] && w[1] > 2e-5)
        .map(|w| w[1])
        .collect();
    assert!(peaks.len() >= 3, "{peaks:?}");
    let cycles = (peaks.len() - 1) as f32;
    let decrement = (peaks[0] / peaks[peaks.len() - 1]).ln() / cycles;
    let tau = std::f32::consts::TAU;
    let ratio = decrement / (tau * tau + decrement * decrement).sqrt();
    println!("damping ratio {ratio:.4} where 0.1 is set, over {cycles} cycles");
    assert!((ratio - 0.1).abs() < 0.015, "{ratio}");
}

#[test]
fn elements_turned_inside_out_recover() {
    let settings = SimSettings::default();
    let depth_m = 0.03;
    let shell = slab_shell(0.15, 0.0125, depth_m, &settings);
    let mut solver = Solver::new(&shell, &settings);
    solver.step(&Pose::REST).unwrap();
    // Every tenth surface node is pushed through the layer under it, half the depth down.
    solver.set_state(|vertex, depth_share| {
        let pushed = vertex % 10 == 0 && depth_share == 0.0;
        let down = if pushed { 0.6 * depth_m } else { 0.0 };
        (Vec3::NEG_Y * down, Vec3::ZERO)
    });
    for _ in 0..120 {
        solver.step(&Pose::REST).unwrap();
    }
    let largest = solver
        .displacements_world_m()
        .map(|d| d.length())
        .fold(0.0, f32::max);
    println!("largest displacement two seconds later: {largest} m");
    assert!(largest < 1e-4, "{largest} m");
}
