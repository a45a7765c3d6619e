//! From a plant file to a converter.

use std::path::PathBuf;
use std::sync::{Arc, Mutex};

use closed_loop::Error;
use closed_loop::outside::Outside;
use plant::Parameters;
use sha2::{Digest, Sha256};
use toml_input::{Document, FileName, Message, Sink};

use crate::archive::{self, Archive};
use crate::converter::FmuConverter;
use crate::description::{self, Description, Version};
use crate::instance::{Binary, Instance};
use crate::log::Tell;
use crate::wiring::{Settings, Wiring};

/// An FMU that is loaded, wired to the names of a plant file.
#[derive(Debug)]
pub(crate) struct Model {
    pub binary: Arc<Binary>,
    pub wiring: Wiring,
    pub variable_step: bool,
    /// The file's numbers.
    pub nominal: Parameters,
    /// Name of the archive, for messages.
    pub shown: String,
    /// SHA-256 of archive and plant file.
    pub identity: Vec<u8>,
    /// The instance of all, where there may be one only, and whose it is.
    pub only: Option<Mutex<Option<(Instance, u64)>>>,
}

/// Opens the FMU of a plant file: reads, checks, unpacks, and loads its binary, which runs foreign code. `nominal` are the file's
/// numbers; `tell` is given what the FMU says.
///
/// # Errors
/// If the file has no sound `[fmu]` table; if the archive, its description or its binary is not sound, of another version, or not for
/// this machine; if a variable is missing or of another kind.
pub fn open(file: &FileName, nominal: &Parameters, tell: Option<Tell>) -> Result<Box<dyn Outside>, Error> {
    let document = Document::open(file.clone())?;
    let mut faults = Sink::new();
    let model = model(&document, nominal, tell, &mut faults);
    let model = document.conclude(model, faults)?;
    Ok(Box::new(FmuConverter::new(Arc::new(model))))
}

/// Reads archive and description of an FMU, every member of it, and runs nothing: version of FMI and number of variables.
///
/// # Errors
/// As [`open`], as far as the archive and its description are concerned.
pub fn look(file: &FileName) -> Result<(Version, usize), Error> {
    let looked = file.read(archive::LARGEST).and_then(|bytes| {
        let archive = Archive::new(bytes)?;
        for name in archive.names() {
            archive.get(name, description::LARGEST)?;
        }
        let told = described(&archive)?;
        Ok((told.version, told.variables.len()))
    });
    looked.map_err(|message| file.fault(message).into())
}

/// [`look`] at the text of a modelDescription.xml alone, called `file` in faults.
///
/// # Errors
/// If it is not sound.
pub fn look_at_description(file: &FileName, text: &[u8]) -> Result<(Version, usize), Error> {
    let told = Description::read(text).map_err(|message| file.fault(message))?;
    Ok((told.version, told.variables.len()))
}

fn described(archive: &Archive) -> Result<Description, Message> {
    let text = archive.get("modelDescription.xml", description::LARGEST)?;
    Description::read(&text.ok_or_else(|| Message::new("the FMU has no modelDescription.xml"))?)
}

fn model(document: &Document, nominal: &Parameters, tell: Option<Tell>, faults: &mut Sink) -> Option<Model> {
    let settings = Settings::new(document, faults)?;
    let shown = settings.name.shown.display().to_string();
    let name = settings.name.clone();
    let bytes = name
        .read(archive::LARGEST)
        .map_err(|message| faults.push(settings.fault(message)))
        .ok()?;
    let mut digest = Sha256::new();
    digest.update(&bytes);
    digest.update(document.source().text.as_bytes());
    let read = Archive::new(bytes).and_then(|archive| {
        let told = described(&archive)?;
        Ok((archive, told))
    });
    let (archive, told) = read.map_err(|message| faults.push(name.fault(message))).ok()?;
    let file = library(&archive, &told)
        .map_err(|message| faults.push(name.fault(message)))
        .ok()?;
    let before = faults.count();
    let wiring = settings.wire(&told, nominal, faults)?;
    // nothing foreign runs before every name is known to be right
    if faults.count() > before {
        return None;
    }
    let folder = file
        .parent()
        .map(|folder| format!("{}/", folder.display()))
        .unwrap_or_default();
    let binary = archive.unpack(&[&folder, "resources/"]);
    let binary = binary.and_then(|unpacked| Binary::load(unpacked, &file, told.version, &told.token, &shown, tell));
    let binary = binary.map_err(|message| faults.push(name.fault(message))).ok()?;
    Some(Model {
        binary: Arc::new(binary),
        wiring,
        variable_step: told.variable_step,
        nominal: nominal.clone(),
        shown,
        identity: digest.finalize().to_vec(),
        only: told.once_per_process.then(|| Mutex::new(None)),
    })
}

/// Where the binary for this machine lies in the archive.
fn library(archive: &Archive, told: &Description) -> Result<PathBuf, Message> {
    let found =
        platform(told.version).map(|(folder, ending)| format!("binaries/{folder}/{}.{ending}", told.identifier));
    if let Some(path) = found
        .as_ref()
        .filter(|path| archive.names().any(|name| name == path.as_str()))
    {
        return Ok(PathBuf::from(path));
    }
    let mut others: Vec<&str> = archive
        .names()
        .filter_map(|name| name.strip_prefix("binaries/")?.split('/').next())
        .collect();
    others.dedup();
    let others = if others.is_empty() {
        "none".to_owned()
    } else {
        others.join(", ")
    };
    let message = Message::new("the FMU has no binary for this machine").found(format!("binaries for: {others}"));
    let expected = found.unwrap_or_else(|| "Linux, Windows or macOS".to_owned());
    Err(message
        .expected(expected)
        .hint("export it for this system; of one with sources `fmpy compile FILE.fmu` makes a binary here"))
}

/// The folder of this machine's binaries and their ending.
fn platform(version: Version) -> Option<(&'static str, &'static str)> {
    use std::env::consts::{ARCH, DLL_EXTENSION, OS};
    let folder = match (version, OS, ARCH) {
        (Version::Two, "linux", "x86_64") => "linux64",
        (Version::Two, "windows", "x86_64") => "win64",
        (Version::Two, "macos", _) => "darwin64",
        (Version::Three, "linux", "x86_64") => "x86_64-linux",
        (Version::Three, "linux", "aarch64") => "aarch64-linux",
        (Version::Three, "windows", "x86_64") => "x86_64-windows",
        (Version::Three, "macos", "x86_64") => "x86_64-darwin",
        (Version::Three, "macos", "aarch64") => "aarch64-darwin",
        _ => return None,
    };
    Some((folder, DLL_EXTENSION))
}
