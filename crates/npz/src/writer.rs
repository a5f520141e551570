//! Writing an archive, whole or not at all.

use std::fs::{self, File};
use std::io::{BufWriter, Seek, Write};
use std::path::{Path, PathBuf};

use npyz::{AutoSerialize, NpyWriter, WriterBuilder};
use zip::write::SimpleFileOptions;

use crate::NpzError;

/// An archive being written beside its final place. [`Writer::finish`] moves it there; dropped
/// before that it is removed.
#[derive(Debug)]
pub struct Writer {
    path: PathBuf,
    temporary: PathBuf,
    zip: Option<zip::ZipWriter<BufWriter<File>>>,
}

impl Writer {
    /// Starts an archive that will stand at `path`.
    ///
    /// # Errors
    /// [`NpzError::Io`] if its folder cannot be written to.
    pub fn create(path: &Path) -> Result<Self, NpzError> {
        let mut name = path.file_name().unwrap_or_default().to_os_string();
        name.push(format!(".{}.part", std::process::id()));
        // A sibling, so that the rename stays within one file system.
        let temporary = path.with_file_name(name);
        let file = File::create(&temporary).map_err(|source| NpzError::Io {
            path: temporary.clone(),
            action: "creating",
            source,
        })?;
        Ok(Self {
            path: path.to_owned(),
            temporary,
            zip: Some(zip::ZipWriter::new(BufWriter::new(file))),
        })
    }

    /// Adds an array, deflated, in C order.
    ///
    /// # Errors
    /// [`NpzError::Array`] if `values` are not as many as `shape` says, [`NpzError::Io`] if the
    /// file cannot be written.
    pub fn array<T: AutoSerialize + Copy>(
        &mut self,
        key: &str,
        shape: &[usize],
        values: &[T],
    ) -> Result<(), NpzError> {
        let count: usize = shape.iter().product();
        if count != values.len() {
            return Err(NpzError::array(
                key,
                format!("{count} numbers for shape {shape:?}"),
                values.len().to_string(),
            ));
        }
        let written = match &mut self.zip {
            Some(zip) => write_array(zip, key, shape, values),
            None => Ok(()),
        };
        written.map_err(|source| self.io("writing", source))
    }

    /// Adds an array like [`Self::array`] whose values come in pieces: `fill` hands them on in C order, and
    /// gives what it likes. Nothing of the array is held.
    ///
    /// # Errors
    /// As [`Self::array`]. An error that `fill` gives is in the inner result; the archive is then of no use.
    pub fn stream<T: AutoSerialize + Copy, R, E>(
        &mut self,
        key: &str,
        shape: &[usize],
        fill: impl FnOnce(&mut dyn FnMut(&[T]) -> Result<(), NpzError>) -> Result<R, E>,
    ) -> Result<Result<R, E>, NpzError> {
        let count = shape
            .iter()
            .try_fold(1_usize, |product, &length| product.checked_mul(length));
        let count = count.ok_or_else(|| {
            NpzError::array(key, "a shape that fits into memory", format!("{shape:?}"))
        })?;
        let temporary = self.temporary.clone();
        let io = |source| NpzError::Io {
            path: temporary.clone(),
            action: "writing",
            source,
        };
        let wrong = |written: usize| {
            let expected = format!("{count} numbers for shape {shape:?}");
            NpzError::array(key, expected, written.to_string())
        };
        let Some(zip) = &mut self.zip else {
            return Err(wrong(0));
        };
        let bytes = count.saturating_mul(size_of::<T>());
        let mut array = begin_array::<T>(zip, key, shape, bytes as u64).map_err(io)?;
        let mut written = 0;
        let given = fill(&mut |values| {
            written += values.len();
            if written > count {
                return Err(wrong(written));
            }
            for value in values {
                array.push(value).map_err(io)?;
            }
            Ok(())
        });
        if given.is_ok() {
            if written != count {
                return Err(wrong(written));
            }
            array.finish().map_err(io)?;
        }
        Ok(given)
    }

    /// Ends the archive and puts it in its place.
    ///
    /// # Errors
    /// [`NpzError::Io`]; what stood at the path before is then still there.
    pub fn finish(mut self) -> Result<(), NpzError> {
        let Some(zip) = self.zip.take() else {
            return Ok(());
        };
        let done = zip
            .finish()
            .map_err(std::io::Error::from)
            .and_then(|mut buffer| {
                buffer.flush()?;
                buffer.get_ref().sync_all()
            });
        done.map_err(|source| self.io("writing", source))?;
        fs::rename(&self.temporary, &self.path).map_err(|source| self.io("renaming", source))
    }

    fn io(&self, action: &'static str, source: std::io::Error) -> NpzError {
        NpzError::Io {
            path: self.temporary.clone(),
            action,
            source,
        }
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        // Gone already after a rename; after a failure there is nothing more to do if this fails.
        let _ = fs::remove_file(&self.temporary);
    }
}

fn write_array<T: AutoSerialize + Copy>(
    zip: &mut zip::ZipWriter<impl Write + Seek>,
    key: &str,
    shape: &[usize],
    values: &[T],
) -> std::io::Result<()> {
    let mut array = begin_array::<T>(zip, key, shape, size_of_val(values) as u64)?;
    for value in values {
        array.push(value)?;
    }
    array.finish()
}

fn begin_array<'a, T: AutoSerialize>(
    zip: &'a mut zip::ZipWriter<impl Write + Seek>,
    key: &str,
    shape: &[usize],
    bytes: u64,
) -> std::io::Result<NpyWriter<T, impl Write + 'a>> {
    // NumPy reads any size; zip must be told about more than 4 GB beforehand.
    let options = SimpleFileOptions::default().large_file(bytes > u64::from(u32::MAX) / 2);
    zip.start_file(format!("{key}.npy"), options)?;
    let shape: Vec<u64> = shape.iter().map(|&length| length as u64).collect();
    npyz::WriteOptions::new()
        .default_dtype()
        .shape(&shape)
        .writer(zip)
        .begin_nd()
}
