//! Makes a data set in the layout of Dyna, to try [From your captures to a page] without licensed files: ten people,
//! 133 sequences of 2 to 12 s at 60 Hz, and a body of SMPL's layout.
//!
//! ```sh
//! cargo run --release -p dynaskin-cli --example made_captures -- MOCAP OUT
//! ```
//!
//! `MOCAP` is a folder with seven BVH files of the CMU motion capture database; the other seven motions are
//! procedural. Tissue is simulated (ten minutes on two cores), and every person's joints lie 1 cm from where its
//! shape puts them. `OUT` gets `clips` (the simulated offsets, for `dynaskin train`), `smpl_female.npz`, and
//! `captures` (HDF5, 4.2 GB, for `dynaskin fit-all`). A clip that is there already is not simulated again.
//!
//! [From your captures to a page]: ../../../docs/your-captures.md

// The tests' writer of SMPL files panics where a file cannot be written; progress goes to the terminal.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

#[path = "../tests/common/smpl_file.rs"]
mod smpl_file;

use std::path::{Path, PathBuf};
use std::{env, error, fs};

use dynaskin_body::{BodyModel, JOINT_COUNT, Materials, SkinMatrices, skin_linear};
use dynaskin_motion::{Procedural, ProceduralKind};
use dynaskin_sim::{ClipData, Job, Motion, Outcome, RigHabit, Run, SimSettings, execute};
use glam::Vec3;
use hdf5_writer::{DatasetBuilder, Hdf5Builder, WriteOptions};
use sha2::{Digest as _, Sha256};

const PEOPLE: [&str; 10] = [
    "50002", "50004", "50007", "50009", "50020", "50021", "50022", "50025", "50026", "50027",
];

/// Motions and the captures they come from.
const CAPTURES: [(&str, &str); 7] = [
    ("jumping_jacks", "14_06a"),
    ("punching", "02_05a"),
    ("squats", "14_06c"),
    ("side_stretches", "14_06e"),
    ("arms_out_twists", "14_20b"),
    ("forward_jump", "16_05"),
    ("bend_over", "14_20d"),
];
const PROCEDURAL: [(&str, ProceduralKind); 7] = [
    ("jump", ProceduralKind::Jump),
    ("hop", ProceduralKind::Hop),
    ("one_leg_jump", ProceduralKind::OneLegHop),
    ("running_on_spot", ProceduralKind::RunInPlace),
    ("walk", ProceduralKind::Walk),
    ("twist", ProceduralKind::Twist),
    ("shake_hips", ProceduralKind::ShakeHips),
];

/// Numbers from 0 to 1 that are the same with every version of every library: measurements quote this data set.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        let step = self.0.wrapping_mul(6_364_136_223_846_793_005);
        self.0 = step.wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / (1_u64 << 31) as f64
    }
}

fn main() -> Result<(), Box<dyn error::Error>> {
    let folders: Vec<PathBuf> = env::args_os().skip(1).map(PathBuf::from).collect();
    let [mocap, out] = &folders[..] else {
        return Err("say: made_captures MOCAP OUT".into());
    };
    let glb = fs::read("models/female/body.glb")?;
    let ours = BodyModel::from_glb(&glb)?;
    let mut sequences = sequences(mocap);
    println!("{} sequences", sequences.len());

    let simulated = out.join("simulated");
    fs::create_dir_all(&simulated)?;
    simulate(&ours, &glb, &simulated, &mut sequences)?;
    let clips = out.join("clips");
    fs::create_dir_all(&clips)?;
    for Sequence {
        person,
        motion,
        job,
    } in &sequences
    {
        let from = simulated.join(format!("{}.safetensors", job.name()));
        fs::copy(from, clips.join(format!("{motion}__{person}.safetensors")))?;
    }

    let smpl = out.join("smpl_female.npz");
    smpl_file::Made::of(&ours)
        .with_smooth_pose_dirs()
        .write(&ours, &smpl);
    let body = BodyModel::from_smpl_npz(&fs::read(&smpl)?)?;
    let captures = out.join("captures");
    fs::create_dir_all(&captures)?;
    // A file of everyone would be held in memory as a whole while it is written.
    for (people, name) in PEOPLE
        .chunks(5)
        .zip(["dyna_female_1.h5", "dyna_female_2.h5"])
    {
        let of_file = sequences.iter().filter(|s| people.contains(&s.person));
        write_captures(&body, of_file, &clips, &captures.join(name))?;
    }
    Ok(())
}

/// One sequence of one person.
struct Sequence {
    person: &'static str,
    motion: &'static str,
    job: Job,
}

/// Everybody's sequences; seven people lack one procedural motion each.
fn sequences(mocap: &Path) -> Vec<Sequence> {
    let mut numbers = Numbers(7);
    let mut sequences = Vec::new();
    for (shape, person) in PEOPLE.into_iter().enumerate() {
        let mut add = |motion, of| {
            let job = Job {
                motion: of,
                mirrored: false,
                shape,
                materials: Materials::NOMINAL,
                rig: RigHabit::NONE,
                frames: 0,
                notes: Vec::new(),
            };
            sequences.push(Sequence {
                person,
                motion,
                job,
            });
        };
        for (idx, (motion, kind)) in PROCEDURAL.into_iter().enumerate() {
            let usual = Procedural::new(kind);
            let tempo_hz = usual.tempo_hz * (0.85 + 0.3 * numbers.next());
            let height_m = usual.height_m * (0.75 + 0.5 * numbers.next());
            let drawn_seconds = 3.0 + 9.0 * numbers.next().powi(2);
            let shortest_seconds = if kind == ProceduralKind::Twist {
                6.2
            } else {
                4.2
            };
            let parameters = Procedural {
                tempo_hz,
                height_m,
                duration_seconds: drawn_seconds.max(shortest_seconds),
                ..usual
            };
            if shape < 3 || idx != shape % 7 {
                let name = format!("{motion}-{person}");
                add(motion, Motion::Procedural { name, parameters });
            }
        }
        for (motion, file) in CAPTURES {
            let of = Motion::Capture {
                name: format!("{motion}-{person}"),
                path: mocap.join(format!("{file}.bvh")),
                speed: 0.9 + 0.2 * numbers.next(),
                options: Default::default(),
            };
            add(motion, of);
        }
    }
    sequences
}

/// Simulates what is not in the folder yet.
fn simulate(
    body: &BodyModel,
    glb: &[u8],
    out: &Path,
    sequences: &mut [Sequence],
) -> Result<(), Box<dyn error::Error>> {
    let joints_m = body.shaped(&[0.0; 10]).joints_m;
    for Sequence { job, .. } in sequences.iter_mut() {
        job.frames = job.motion.clip(&joints_m)?.frames.len();
    }
    // The longest first, so that both cores end at one time.
    let mut jobs: Vec<Job> = sequences.iter().map(|s| s.job.clone()).collect();
    jobs.sort_by_key(|job| std::cmp::Reverse(job.frames));
    let body_sha256: String = Sha256::digest(glb)
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    let run = Run {
        body,
        body_sha256: &body_sha256,
        settings: SimSettings::for_body(body),
        seed: 1,
        out: out.to_path_buf(),
        limit_frames: None,
        mirrored: false,
        vary_materials: false,
        vary_rigs: false,
        shapes: 7,
        further_shapes: false,
    };
    for report in execute(&run, &jobs, |report| println!("{}", report.name))? {
        if let Outcome::Failed(failure) = report.outcome {
            return Err(format!("{}: {failure}", report.name).into());
        }
    }
    Ok(())
}

/// Writes registered meshes, [vertices, 3, frames] in metres, of people whose joints are not where β puts them.
fn write_captures<'a>(
    body: &BodyModel,
    sequences: impl Iterator<Item = &'a Sequence>,
    clips: &Path,
    path: &Path,
) -> Result<(), Box<dyn error::Error>> {
    let mut builder = Hdf5Builder::new();
    for Sequence {
        person,
        motion,
        job,
    } in sequences
    {
        let clip = ClipData::read(&clips.join(format!("{motion}__{person}.safetensors")))?;
        let shaped = body.shaped(&clip.shape);
        let mut joints_m = shaped.joints_m;
        let mut numbers = Numbers(100 + job.shape as u64);
        for joint_m in joints_m.iter_mut().take(JOINT_COUNT) {
            let mut axis = || (numbers.next() - 0.5) as f32;
            let direction = Vec3::new(axis(), axis(), axis());
            *joint_m += 0.01 * direction.normalize();
        }
        let (vertices, frames) = (body.vertex_count(), clip.frame_count());
        let mut numbers_m = vec![0.0_f32; 3 * vertices * frames];
        let mut world_m = vec![Vec3::ZERO; vertices];
        for frame in 0..frames {
            let mut rest_m = shaped.positions_m.clone();
            body.add_pose_correctives(&clip.poses[frame], &mut rest_m);
            for (slot, vertex) in clip.vertices.iter().enumerate() {
                rest_m[*vertex as usize] += clip.offset_rest_m(frame, slot);
            }
            let matrices = SkinMatrices::new(&clip.poses[frame], &joints_m);
            skin_linear(&rest_m, &body.skin, &matrices, &mut world_m);
            for (at, number) in world_m.iter().flat_map(|p| p.to_array()).enumerate() {
                numbers_m[at * frames + frame] = number;
            }
        }
        let shape = [vertices as u64, 3, frames as u64];
        let name = format!("{person}_{motion}");
        builder = builder.dataset(DatasetBuilder::typed_data(&name, shape, &numbers_m)?);
    }
    fs::write(path, builder.into_plan()?.encode(WriteOptions::default())?)?;
    println!("{}", path.display());
    Ok(())
}
