//! Seeds written as files for the fuzzers, and what the fuzzers found packed into the repository.
//!
//! `corpus seeds TARGET FOLDER`, `corpus unpack TARGET FOLDER`, `corpus pack TARGET FOLDER BYTES`.

use std::error::Error;
use std::fs;
use std::path::Path;

use dynaskin_fuzzing::{Target, corpus_path, pack, saved};

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    let [task, target, folder, rest @ ..] = &args[..] else {
        return Err("usage: corpus seeds|unpack|pack TARGET FOLDER [BYTES]".into());
    };
    let target = Target::from_name(target).ok_or_else(|| format!("no target `{target}`"))?;
    let folder = Path::new(folder);
    match (*task, rest) {
        ("seeds", []) => write(folder, "seed", &target.seeds()),
        ("unpack", []) if !corpus_path(target).exists() => Ok(()),
        ("unpack", []) => write(folder, "saved", &saved(target)?),
        ("pack", [bytes]) => pack_smallest(target, folder, bytes.parse()?),
        _ => Err(format!("no task `{task}` with {} more words", rest.len()).into()),
    }
}

fn write(folder: &Path, prefix: &str, files: &[Vec<u8>]) -> Result<(), Box<dyn Error>> {
    fs::create_dir_all(folder)?;
    for (idx, file) in files.iter().enumerate() {
        fs::write(folder.join(format!("{prefix}-{idx:04}")), file)?;
    }
    Ok(())
}

/// Packs the smallest files of a folder, as many as fit into `limit` packed bytes.
fn pack_smallest(target: Target, folder: &Path, limit: usize) -> Result<(), Box<dyn Error>> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder)? {
        files.push(fs::read(entry?.path())?);
    }
    files.sort_by(|a, b| (a.len(), a).cmp(&(b.len(), b)));
    let (mut fits, mut too_many) = (0, files.len() + 1);
    while too_many - fits > 1 {
        let count = fits.midpoint(too_many);
        match pack(&files[..count])?.len() <= limit {
            true => fits = count,
            false => too_many = count,
        }
    }
    let packed = pack(&files[..fits])?;
    let path = corpus_path(target);
    fs::create_dir_all(path.parent().unwrap_or(folder))?;
    fs::write(&path, &packed)?;
    let (name, all, bytes) = (target.name(), files.len(), packed.len());
    writeln(&format!("{name}: {fits} of {all} inputs in {bytes} bytes"))
}

fn writeln(line: &str) -> Result<(), Box<dyn Error>> {
    use std::io::Write as _;
    Ok(writeln!(std::io::stdout(), "{line}")?)
}
