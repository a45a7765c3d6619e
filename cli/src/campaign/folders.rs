//! Folders as maps of files, and back.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::Path;

use toml_input::Message;

use crate::failure::Failure;
use crate::staging;

/// Content by path.
pub type Files = BTreeMap<String, Vec<u8>>;

/// Every file of a folder and its folders, by its path from there with `/`; nothing if there is no such folder.
pub fn read(folder: &Path) -> Result<Files, Failure> {
    let mut files = Files::new();
    add(folder, "", &mut files).map_err(|error| cannot("read", folder, &error))?;
    Ok(files)
}

fn add(folder: &Path, prefix: &str, files: &mut Files) -> io::Result<()> {
    let entries = match fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(error),
    };
    for entry in entries {
        let entry = entry?;
        let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
        let path = entry.path();
        match entry.file_type()?.is_dir() {
            true => add(&path, &format!("{name}/"), files)?,
            false => {
                files.insert(name, fs::read(&path)?);
            }
        }
    }
    Ok(())
}

/// Makes a folder that holds these files alone.
pub fn write<B: AsRef<[u8]>>(folder: &Path, files: &BTreeMap<String, B>) -> Result<(), Failure> {
    let write = || -> io::Result<()> {
        remove(folder)?;
        fs::create_dir_all(folder)?;
        for (name, bytes) in files {
            let path = folder.join(name);
            if let Some(parent) = path.parent() {
                fs::create_dir_all(parent)?;
            }
            fs::write(&path, bytes)?;
        }
        Ok(())
    };
    write().map_err(|error| cannot("write", folder, &error))
}

/// Puts a folder into the place of another, which goes to `old` and stays there: nothing is ever half in its place.
pub fn exchange(new: &Path, place: &Path, old: &Path) -> io::Result<()> {
    remove(old)?;
    if let Some(parent) = place.parent() {
        fs::create_dir_all(parent)?;
    }
    match fs::rename(place, old) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    fs::rename(new, place).inspect_err(|_| {
        // unless another process has put its own there
        let _ = fs::rename(old, place);
    })
}

/// Whether there is a file in a folder or the folders in it; what is on its way into the folder itself does not count.
pub fn holds_a_file(folder: &Path) -> io::Result<bool> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let holds = match entry.file_type()?.is_dir() {
            true => holds_a_file(&entry.path())?,
            false => !staging::is_leftover(&entry.file_name().to_string_lossy()),
        };
        if holds {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Removes a folder, if it is there.
pub fn remove(folder: &Path) -> io::Result<()> {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

pub fn cannot(what: &str, path: &Path, error: &io::Error) -> Failure {
    Message::new(format!("cannot {what} {}: {error}", path.display())).into()
}
