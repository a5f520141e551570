//! Frames as a video: pictures drawn in software, which the program ffmpeg puts together.

use std::ffi::OsString;
use std::fs;
use std::io::{ErrorKind, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};

use anyhow::{Context as _, anyhow, bail};
use dynaskin_body::BodyModel;
use dynaskin_clothes::{Tones, hem};
use dynaskin_report::{Picture, Triangle};
use glam::{DVec3, Quat, Vec3};

/// What a body without paint is made of: matt clay, sRGB.
const CLAY: [u8; 3] = [196, 176, 164];
/// What is shown below the floor, in metres.
const BELOW_FLOOR_M: f32 = 0.12;
/// The floor's cut surface, in pieces of two shades: a body that walks is kept in the middle, so they move instead.
const FLOOR: [[u8; 3]; 2] = [[214, 214, 214], [198, 198, 198]];
/// Length of a piece in metres.
const FLOOR_PIECE_M: f32 = 0.5;

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
    pieces: Vec<Piece>,
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
            pieces: painted(body),
        })
    }

    /// Sends a frame: vertex positions in metres, and where the pelvis is, which is kept in the middle.
    pub fn write(&mut self, positions_m: &[Vec3], pelvis_m: DVec3) -> anyhow::Result<()> {
        let png = picture(positions_m, &self.pieces, self.view, pelvis_m.as_vec3())
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

/// The floor behind everything, seen along itself, over the width of the picture; `along_m` is what its pieces are
/// moved by.
fn floor(half_m: f32, along_m: f32) -> impl Iterator<Item = Triangle> {
    const BEHIND_M: f32 = -100.0;
    let first = ((along_m - half_m) / FLOOR_PIECE_M).floor() as i32;
    let last = ((along_m + half_m) / FLOOR_PIECE_M).ceil() as i32;
    (first..last).flat_map(move |piece| {
        let left = piece as f32 * FLOOR_PIECE_M - along_m;
        let right = left + FLOOR_PIECE_M;
        // Also what lies beyond the window's edge, which is as wide as the picture's margin.
        let [low, high] = [-2.0 * BELOW_FLOOR_M, 0.0];
        let corner = |x, y| [x, y, BEHIND_M];
        let colour = FLOOR[piece.rem_euclid(2) as usize];
        [
            [corner(left, low), corner(right, low), corner(right, high)],
            [corner(left, low), corner(right, high), corner(left, high)],
        ]
        .map(|corners| Triangle { corners, colour })
    })
}

/// A place on an edge: this share of the way from the first vertex to the second.
type Place = (u32, u32, f32);

/// A triangle of one colour, on a face of the body or a part of one.
struct Piece {
    corners: [Place; 3],
    colour: [u8; 3],
}

/// The surface of a body in the colours that it is painted in: shipped bodies wear sportswear. Where there are two,
/// faces are cut along the hem between them.
fn painted(body: &BodyModel) -> Vec<Piece> {
    let corner = |vertex: u32| (vertex, vertex, 0.0);
    let Some(Tones { srgb, shares }) = Tones::of(&body.colors_srgba) else {
        let mean = |face: &[u32; 3]| {
            let corners = face.map(|vertex| body.colors_srgba.get(vertex as usize).copied());
            let [Some(a), Some(b), Some(c)] = corners else {
                return CLAY;
            };
            std::array::from_fn(|channel| {
                let sum: u16 = [a, b, c].map(|of| u16::from(of[channel])).iter().sum();
                (sum / 3) as u8
            })
        };
        let whole = |face: &[u32; 3]| Piece {
            corners: face.map(corner),
            colour: mean(face),
        };
        return body.faces.iter().map(whole).collect();
    };
    let places_m: Vec<f32> = body.template_m.iter().flat_map(|p| p.to_array()).collect();
    let distances_m = hem::distances_m(&shares, body.faces.as_flattened(), &places_m);
    let is_second = |vertex: u32| distances_m[vertex as usize] > 0.0;
    let colour = |vertex: u32| srgb[usize::from(is_second(vertex))];
    let mut pieces = Vec::with_capacity(body.faces.len());
    for face in &body.faces {
        // The corner whose colour the others do not have comes first.
        let lone = (0..3).find(|k| {
            let [a, b, c] = [0, 1, 2].map(|step| is_second(face[(k + step) % 3]));
            a != b && a != c
        });
        let Some(lone) = lone else {
            let corners = face.map(corner);
            pieces.push(Piece {
                corners,
                colour: colour(face[0]),
            });
            continue;
        };
        let [a, b, c] = [0, 1, 2].map(|step| face[(lone + step) % 3]);
        let cut = |other: u32| {
            let [from, to] = [a, other].map(|vertex| distances_m[vertex as usize]);
            (a, other, from / (from - to))
        };
        let (of_lone, of_others) = (colour(a), colour(b));
        let corners = [
            ([corner(a), cut(b), cut(c)], of_lone),
            ([cut(b), corner(b), corner(c)], of_others),
            ([cut(b), corner(c), cut(c)], of_others),
        ];
        pieces.extend(corners.map(|(corners, colour)| Piece { corners, colour }));
    }
    pieces
}

fn picture(positions_m: &[Vec3], pieces: &[Piece], view: View, pelvis_m: Vec3) -> Picture {
    let middle_m = Vec3::new(pelvis_m.x, 0.0, pelvis_m.z);
    // A body turned by -turn is seen from turn.
    let turn = Quat::from_rotation_y(-view.turn_radians);
    let seen_m: Vec<Vec3> = positions_m
        .iter()
        .map(|position_m| turn * (*position_m - middle_m))
        .collect();
    let of_vertex = |vertex: u32| seen_m.get(vertex as usize).copied().unwrap_or_default();
    let place = |(from, to, share): Place| of_vertex(from).lerp(of_vertex(to), share).to_array();
    let half_m = 0.5 * (view.height_m + BELOW_FLOOR_M);
    let body = pieces.iter().map(|piece| Triangle {
        corners: piece.corners.map(place),
        colour: piece.colour,
    });
    Picture {
        size: (view.size_px, view.size_px),
        triangles: floor(half_m + FLOOR_PIECE_M, (turn * middle_m).x)
            .chain(body)
            .collect(),
        window: Some([[-half_m, half_m], [-BELOW_FLOOR_M, view.height_m]]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_are_cut_along_the_hem_and_nothing_is_lost() {
        let glb = fs::read("../../models/female/body.glb").unwrap();
        let body = BodyModel::from_glb(&glb).unwrap();
        let pieces = painted(&body);
        let area_m2 = |[a, b, c]: [Vec3; 3]| 0.5 * (b - a).cross(c - a).length();
        let at = |vertex: u32| body.template_m[vertex as usize];
        let of_faces: f32 = body.faces.iter().map(|face| area_m2(face.map(at))).sum();
        let of_pieces: f32 = pieces
            .iter()
            .map(|piece| {
                area_m2(
                    piece
                        .corners
                        .map(|(from, to, share)| at(from).lerp(at(to), share)),
                )
            })
            .sum();
        assert!(
            (of_pieces / of_faces - 1.0).abs() < 1e-4,
            "{of_pieces} of {of_faces} m²"
        );
        assert!(pieces.len() > body.faces.len() + 200);
        // Skin and cloth, no mixtures.
        let mut colours: Vec<[u8; 3]> = pieces.iter().map(|piece| piece.colour).collect();
        colours.sort_unstable();
        colours.dedup();
        assert_eq!(colours.len(), 2);
    }

    #[test]
    fn the_floor_moves_under_who_is_kept_in_the_middle() {
        let edges = |along_m: f32| -> Vec<f32> {
            let lefts = floor(1.0, along_m).step_by(2).map(|t| t.corners[0][0]);
            lefts.collect()
        };
        assert_eq!(edges(0.0), [-1.0, -0.5, 0.0, 0.5]);
        assert_eq!(edges(0.125), [-1.125, -0.625, -0.125, 0.375, 0.875]);
        let colours = |along_m: f32| floor(1.0, along_m).next().map(|t| t.colour);
        assert_ne!(colours(0.0), colours(0.5));
    }
}
