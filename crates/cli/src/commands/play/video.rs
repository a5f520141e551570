//! Frames as a video: pictures drawn in software, which the program ffmpeg puts together.

use std::ffi::OsString;
use std::fs;
use std::io::{ErrorKind, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};

use anyhow::{Context as _, anyhow, bail};
use dynaskin_body::BodyModel;
use dynaskin_report::{Picture, Triangle};
use glam::{DVec3, Quat, Vec3};

/// What a body without paint is made of: matt clay, sRGB.
const CLAY: [u8; 3] = [196, 176, 164];
/// Room below the floor, in metres.
const BELOW_FLOOR_M: f32 = 0.12;

/// From where and how much a video shows.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Width and height in pixels.
    pub size_px: u32,
    /// About the vertical, in radians: 0 from the front.
    pub turn_radians: f32,
    /// From the floor to the upper edge, in metres.
    pub height_m: f32,
}

/// A video that is being written. It goes beside its place until it is whole.
pub struct Video {
    ffmpeg: Child,
    /// None once all pictures are sent.
    pictures: Option<ChildStdin>,
    path: PathBuf,
    unfinished: PathBuf,
    view: View,
    /// Each with its colour.
    faces: Vec<([u32; 3], [u8; 3])>,
}

impl Video {
    /// Starts ffmpeg.
    pub fn start(path: &Path, fps: f64, view: View, body: &BodyModel) -> anyhow::Result<Self> {
        let unfinished = beside(path)?;
        let started = Command::new("ffmpeg")
            .args(["-hide_banner", "-loglevel", "error", "-y"])
            .args(["-f", "image2pipe", "-c:v", "png"])
            .args(["-framerate", &fps.to_string(), "-i", "-"])
            // What every player shows: even sizes, and colours at half the resolution.
            .args([
                "-vf",
                "pad=ceil(iw/2)*2:ceil(ih/2)*2",
                "-pix_fmt",
                "yuv420p",
            ])
            .args(["-movflags", "+faststart", "-f", "mp4"])
            .arg(&unfinished)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn();
        let mut ffmpeg = match started {
            Ok(ffmpeg) => ffmpeg,
            Err(error) if error.kind() == ErrorKind::NotFound => bail!(
                "a video needs the program ffmpeg, which is not on this machine's PATH; install it (`apt install ffmpeg`, \
                 `brew install ffmpeg`), or give --out a folder for meshes"
            ),
            Err(error) => return Err(anyhow!(error).context("cannot start ffmpeg")),
        };
        let pictures = ffmpeg.stdin.take();
        Ok(Self {
            ffmpeg,
            pictures,
            path: path.to_owned(),
            unfinished,
            view,
            faces: painted(body),
        })
    }

    /// Sends a frame: vertex positions in metres, and where the pelvis is, which is kept in the middle.
    pub fn write(&mut self, positions_m: &[Vec3], pelvis_m: DVec3) -> anyhow::Result<()> {
        let png = picture(positions_m, &self.faces, self.view, pelvis_m.as_vec3())
            .png("a frame of the video")?;
        let sent = match &mut self.pictures {
            Some(pictures) => pictures.write_all(&png),
            None => Ok(()),
        };
        match sent {
            Ok(()) => Ok(()),
            // It has ended: its own words say more.
            Err(_) => self.wait(),
        }
    }

    /// Ends the video and puts it in its place.
    pub fn finish(mut self) -> anyhow::Result<()> {
        self.wait()?;
        fs::rename(&self.unfinished, &self.path)
            .with_context(|| format!("cannot write {}", self.path.display()))
    }

    fn wait(&mut self) -> anyhow::Result<()> {
        drop(self.pictures.take());
        let mut words = String::new();
        if let Some(stderr) = &mut self.ffmpeg.stderr {
            // Whatever it said before that is good enough.
            let _ = std::io::Read::read_to_string(stderr, &mut words);
        }
        let status = self.ffmpeg.wait().context("cannot wait for ffmpeg")?;
        if status.success() {
            return Ok(());
        }
        bail!(
            "{} was not written; ffmpeg says: {}",
            self.path.display(),
            words.trim()
        )
    }
}

impl Drop for Video {
    /// Nothing half written stays, and no program that waits for pictures.
    fn drop(&mut self) {
        drop(self.pictures.take());
        let _ = self.ffmpeg.kill();
        let _ = self.ffmpeg.wait();
        let _ = fs::remove_file(&self.unfinished);
    }
}

/// The name of an unfinished video.
fn beside(path: &Path) -> anyhow::Result<PathBuf> {
    let Some(name) = path.file_name() else {
        bail!("--out {} is no name of a file", path.display());
    };
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)
            .with_context(|| format!("cannot make the folder {}", folder.display()))?;
    }
    let mut unfinished = OsString::from(".");
    unfinished.push(name);
    unfinished.push(format!(".{}", std::process::id()));
    Ok(path.with_file_name(unfinished))
}

/// The triangles of a body in the colours that it is painted in: shipped bodies wear sportswear.
fn painted(body: &BodyModel) -> Vec<([u32; 3], [u8; 3])> {
    let colour = |face: &[u32; 3]| {
        let corners = face.map(|vertex| body.colors_srgba.get(vertex as usize).copied());
        let [Some(a), Some(b), Some(c)] = corners else {
            return CLAY;
        };
        std::array::from_fn(|channel| {
            let sum: u16 = [a, b, c]
                .iter()
                .map(|corner| u16::from(corner[channel]))
                .sum();
            (sum / 3) as u8
        })
    };
    body.faces
        .iter()
        .map(|face| (*face, colour(face)))
        .collect()
}

fn picture(
    positions_m: &[Vec3],
    faces: &[([u32; 3], [u8; 3])],
    view: View,
    pelvis_m: Vec3,
) -> Picture {
    let middle_m = Vec3::new(pelvis_m.x, 0.0, pelvis_m.z);
    // A body turned by -turn is seen from turn.
    let turn = Quat::from_rotation_y(-view.turn_radians);
    let seen: Vec<[f32; 3]> = positions_m
        .iter()
        .map(|position_m| (turn * (*position_m - middle_m)).to_array())
        .collect();
    let corners =
        |face: &[u32; 3]| face.map(|vertex| seen.get(vertex as usize).copied().unwrap_or_default());
    let half_m = 0.5 * (view.height_m + BELOW_FLOOR_M);
    Picture {
        size: (view.size_px, view.size_px),
        triangles: faces
            .iter()
            .map(|(face, colour)| Triangle {
                corners: corners(face),
                colour: *colour,
            })
            .collect(),
        window: Some([[-half_m, half_m], [-BELOW_FLOOR_M, view.height_m]]),
    }
}
