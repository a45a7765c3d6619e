//! Folders as maps of files, and back.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::Path;

use toml_input::Message;

use crate::failure::Failure;

/// Every file of a folder and its folders, by its path from there with `/`; nothing if there is no such folder.
pub fn read(folder: &Path) -> Result<BTreeMap<String, Vec<u8>>, Failure> {
    let mut files = BTreeMap::new();
    add(folder, "", &mut files).map_err(|error| cannot("read", folder, &error))?;
    Ok(files)
}

fn add(folder: &Path, prefix: &str, files: &mut BTreeMap<String, Vec<u8>>) -> io::Result<()> {
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
pub fn write<'a>(folder: &Path, files: impl IntoIterator<Item = (&'a String, &'a [u8])>) -> Result<(), Failure> {
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

/// Puts a folder into the place of another, which goes.
pub fn replace(new: &Path, old: &Path) -> Result<(), Failure> {
    let replace = || -> io::Result<()> {
        remove(old)?;
        if let Some(parent) = old.parent() {
            fs::create_dir_all(parent)?;
        }
        fs::rename(new, old)
    };
    replace().map_err(|error| cannot("replace", old, &error))
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
