//! FMUs as converters: the archive and its description. Nothing of them runs.

use super::Target;
use super::folders::Desk;
use super::seeds::{answer, read};
use crate::forms::{Form, zip};
use crate::guard::{Limits, Reader};

pub(super) static TARGETS: &[Target] = &[
    Target {
        name: "fmu",
        about: "FMUs as archives",
        // a changed member would have another check sum than the one beside it, and be refused for it
        form: Form::Bytes,
        words: &[
            "modelDescription.xml",
            "binaries/",
            "resources/",
            "../",
            "PK\x01\x02",
            "PK\x03\x04",
            "PK\x05\x06",
        ],
        limits: Limits::READER,
        seeds: archives,
        reader: archive,
    },
    Target {
        name: "fmu-description",
        about: "modelDescription.xml of FMUs",
        form: Form::Bytes,
        words: WORDS,
        limits: Limits::READER,
        seeds: || Ok(texts()?.map(String::into_bytes).to_vec()),
        reader: description,
    },
];

const WORDS: &[&str] = &[
    "<CoSimulation",
    "<ScalarVariable",
    "<Float64",
    "<Real",
    "<Dimension start=\"2\"/>",
    "<Unit name=\"V\">",
    "<BaseUnit",
    "</ModelVariables>",
    "causality=\"input\"",
    "valueReference=\"4294967296\"",
    "fmiVersion=\"3.0\"",
    "instantiationToken=\"",
    "fixedInternalStepSize=\"nan\"",
    "&lt;",
    "&#0;",
    "<!DOCTYPE a [<!ENTITY b \"c\">]>",
    "<![CDATA[",
    "<!--",
    "../",
];

fn texts() -> Result<[String; 2], String> {
    let two = String::from_utf8(read("examples/fmu/modelDescription.xml")?).map_err(|error| error.to_string())?;
    let three = two
        .replace("fmiVersion=\"2.0\"", "fmiVersion=\"3.0\"")
        .replace("guid=", "instantiationToken=")
        .replace("<ScalarVariable", "<Float64")
        .replace("</ScalarVariable", "</Float64");
    Ok([two, three])
}

fn archives() -> Result<Vec<Vec<u8>>, String> {
    let archive = |text: String| {
        let members = [
            (b"modelDescription.xml".to_vec(), text.into_bytes()),
            (b"binaries/linux64/buck.so".to_vec(), b"no program".to_vec()),
            (b"resources/table.txt".to_vec(), b"1 2 3".to_vec()),
        ];
        let mut bytes = zip::pack(&members);
        // the packer leaves the check sums at 0; this reader looks at those in the directory
        let mut at = 0;
        for (_, content) in &members {
            at += bytes[at..]
                .windows(4)
                .position(|four| four == b"PK\x01\x02")
                .unwrap_or_default();
            bytes[at + 16..at + 20].copy_from_slice(&check_sum(content).to_le_bytes());
            at += 4;
        }
        bytes
    };
    Ok(texts()?.map(archive).to_vec())
}

/// CRC-32 as in zip, bit by bit: reflected, polynomial 0x04C11DB7.
fn check_sum(bytes: &[u8]) -> u32 {
    let bit = |sum: u32| (sum >> 1) ^ (if sum & 1 == 1 { 0xEDB8_8320 } else { 0 });
    let byte = |sum: u32, byte: &u8| (0..8).fold(sum ^ u32::from(*byte), |sum, _| bit(sum));
    !bytes.iter().fold(!0, byte)
}

fn archive() -> Result<Box<Reader>, String> {
    let desk = Desk::new()?;
    Ok(Box::new(move |bytes| {
        let file = desk.file("converter.fmu", bytes);
        answer(fmu::look(&toml_input::FileName::new(&file)), |(version, variables)| {
            format!("{version:?}, {variables} variables")
        })
    }))
}

fn description() -> Result<Box<Reader>, String> {
    let file = toml_input::FileName::new(std::path::Path::new("modelDescription.xml"));
    Ok(Box::new(move |bytes| {
        answer(fmu::look_at_description(&file, bytes), |(version, variables)| {
            format!("{version:?}, {variables} variables")
        })
    }))
}
