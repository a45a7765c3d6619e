//! FMUs as converters: the archive and its description. Nothing of them runs.

use super::Target;
use super::folders::Desk;
use super::seeds::{answer, read};
use crate::forms::{Form, zip};
use crate::guard::{Limits, Reader};

pub(super) static TARGETS: &[Target] = &[Target {
    name: "fmu",
    about: "FMUs: the archive, and modelDescription.xml in it",
    form: Form::Zip,
    words: WORDS,
    limits: Limits::READER,
    seeds,
    reader,
}];

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

fn seeds() -> Result<Vec<Vec<u8>>, String> {
    let two = String::from_utf8(read("examples/fmu/modelDescription.xml")?).map_err(|error| error.to_string())?;
    let three = two
        .replace("fmiVersion=\"2.0\"", "fmiVersion=\"3.0\"")
        .replace("guid=", "instantiationToken=")
        .replace("<ScalarVariable", "<Float64")
        .replace("</ScalarVariable", "</Float64");
    let archive = |text: &str| {
        let member = |name: &str, content: &[u8]| (name.as_bytes().to_vec(), content.to_vec());
        zip::pack(&[
            member("modelDescription.xml", text.as_bytes()),
            member("binaries/linux64/buck.so", b"no program"),
            member("resources/table.txt", b"1 2 3"),
        ])
    };
    Ok(vec![archive(&two), archive(&three)])
}

fn reader() -> Result<Box<Reader>, String> {
    let desk = Desk::new()?;
    Ok(Box::new(move |bytes| {
        let file = desk.file("converter.fmu", bytes);
        answer(fmu::look(&toml_input::FileName::new(&file)), |(version, variables)| {
            format!("{version:?}, {variables} variables")
        })
    }))
}
