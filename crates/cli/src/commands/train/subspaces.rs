//! `subspaces.csv`: what `--compare-subspaces` measured, for `dynaskin evaluate --report`.

use std::fmt;
use std::str::FromStr;

use anyhow::{Context as _, bail};

/// One line: a frame rebuilt from so many latents.
#[derive(Clone, Debug, PartialEq)]
pub struct SubspaceRow {
    /// Name of the clip.
    pub clip: String,
    /// Numbers that the frame was rebuilt from.
    pub latents: usize,
    /// The frame, at 60 Hz.
    pub frame: usize,
    /// Mean vertex error of the autoencoder in millimetres.
    pub autoencoder_mm: f64,
    /// That of principal components in millimetres.
    pub pca_mm: f64,
}

impl SubspaceRow {
    /// The first line.
    pub const HEAD: &str = "clip,latents,frame,autoencoder_mm,pca_mm";
}

impl fmt::Display for SubspaceRow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            clip,
            latents,
            frame,
            autoencoder_mm,
            pca_mm,
        } = self;
        write!(
            f,
            "{clip},{latents},{frame},{autoencoder_mm:.4},{pca_mm:.4}"
        )
    }
}

impl FromStr for SubspaceRow {
    type Err = anyhow::Error;

    fn from_str(line: &str) -> anyhow::Result<Self> {
        let fields: Vec<&str> = line.split(',').collect();
        let [clip, latents, frame, autoencoder_mm, pca_mm] = fields[..] else {
            bail!("expected {}", Self::HEAD);
        };
        let row = Self {
            clip: clip.to_owned(),
            latents: latents.parse().context("latents")?,
            frame: frame.parse().context("frame")?,
            autoencoder_mm: autoencoder_mm.parse().context("autoencoder_mm")?,
            pca_mm: pca_mm.parse().context("pca_mm")?,
        };
        if !(row.autoencoder_mm.is_finite() && row.pca_mm.is_finite()) {
            bail!("an error that is not a number");
        }
        Ok(row)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_read_back_and_others_refused() {
        let row = SubspaceRow {
            clip: "one-leg-hop-190-060__s0".into(),
            latents: 50,
            frame: 7,
            autoencoder_mm: 0.25,
            pca_mm: 0.5,
        };
        let line = row.to_string();
        assert_eq!(line.parse::<SubspaceRow>().expect("a row"), row);
        assert!("hop,50,7,0.2".parse::<SubspaceRow>().is_err());
        assert!("hop,50,7,NaN,0.5".parse::<SubspaceRow>().is_err());
    }
}
