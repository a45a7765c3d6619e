//! FMUs built from `model/buck.c`, and plant files that name them.

#![allow(clippy::unwrap_used, clippy::panic, dead_code)] // helpers of tests stand outside of #[test] functions; not every test file needs all

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use closed_loop::{Converter, Error};
use tempfile::TempDir;
use toml_input::FileName;

pub const TOKEN: &str = "{policyc-test-buck}";

/// Name, causality, variability, initial, unit; in the order of the value references in `buck.c`.
pub const VARIABLES: [(&str, &str, &str, &str, &str); 14] = [
    ("duty", "input", "continuous", "", "1"),
    ("load.i", "input", "continuous", "", "A"),
    ("load.g", "input", "continuous", "", "S"),
    ("load.p", "input", "continuous", "", "W"),
    ("source.v", "input", "continuous", "", "V"),
    ("L", "parameter", "tunable", "exact", "H"),
    ("C", "parameter", "tunable", "exact", "F"),
    ("R_L", "parameter", "fixed", "exact", "Ohm"),
    ("v_start", "parameter", "fixed", "exact", "V"),
    ("i_start", "parameter", "fixed", "exact", "A"),
    ("out.v", "output", "continuous", "calculated", "V"),
    ("inductor.i", "output", "continuous", "calculated", "A"),
    ("out.i", "output", "continuous", "calculated", "A"),
    ("in.v", "local", "continuous", "calculated", "V"),
];

/// An FMU to be.
#[derive(Clone)]
pub struct Draft {
    pub fmi: u8,
    pub flags: Vec<String>,
    /// Attributes of `<CoSimulation>`.
    pub attributes: String,
    /// First of what is found in the description, and what takes its place.
    pub edits: Vec<(String, String)>,
    pub platform: String,
}

impl Draft {
    pub fn new(fmi: u8) -> Self {
        Self {
            fmi,
            flags: Vec::new(),
            attributes: "canHandleVariableCommunicationStepSize=\"true\"".to_owned(),
            edits: Vec::new(),
            platform: if fmi == 2 { "linux64" } else { "x86_64-linux" }.to_owned(),
        }
    }

    pub fn flag(mut self, flag: &str) -> Self {
        self.flags.push(format!("-D{flag}"));
        self
    }

    pub fn attributes(mut self, attributes: &str) -> Self {
        self.attributes = attributes.to_owned();
        self
    }

    pub fn edit(mut self, from: &str, to: &str) -> Self {
        self.edits.push((from.to_owned(), to.to_owned()));
        self
    }

    pub fn description(&self) -> String {
        let mut text = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
        let version = if self.fmi == 2 {
            format!("fmiVersion=\"2.0\" guid=\"{TOKEN}\"")
        } else {
            format!("fmiVersion=\"3.0\" instantiationToken=\"{TOKEN}\"")
        };
        let _ = write!(
            text,
            "<fmiModelDescription {version} modelName=\"buck\">\n  <CoSimulation modelIdentifier=\"buck\" {}/>\n  <UnitDefinitions>\n    \
             <Unit name=\"V\"><BaseUnit kg=\"1\" m=\"2\" s=\"-3\" A=\"-1\"/></Unit>\n    <Unit name=\"A\"><BaseUnit A=\"1\"/></Unit>\n  \
             </UnitDefinitions>\n  <ModelVariables>\n",
            self.attributes
        );
        for (reference, (name, causality, variability, initial, unit)) in VARIABLES.iter().enumerate() {
            let initial = if initial.is_empty() {
                String::new()
            } else {
                format!(" initial=\"{initial}\"")
            };
            let start = if ["input", "parameter"].contains(causality) {
                " start=\"0\""
            } else {
                ""
            };
            // a unit that is not defined may not be declared: FMPy's check
            let unit = if ["V", "A"].contains(unit) {
                format!(" unit=\"{unit}\"")
            } else {
                String::new()
            };
            let head = format!(
                "name=\"{name}\" valueReference=\"{reference}\" causality=\"{causality}\" variability=\"{variability}\"{initial}"
            );
            let _ = match self.fmi {
                2 => writeln!(text, "    <ScalarVariable {head}><Real{unit}{start}/></ScalarVariable>"),
                _ => writeln!(text, "    <Float64 {head}{unit}{start}/>"),
            };
        }
        let outputs = [10, 11, 12];
        if self.fmi == 3 {
            // the standard wants the time among the variables
            text.push_str("    <Float64 name=\"time\" valueReference=\"99\" causality=\"independent\" variability=\"continuous\"/>\n");
        }
        text.push_str("  </ModelVariables>\n  <ModelStructure>\n");
        if self.fmi == 2 {
            let list = |tag: &str| {
                let all: String = outputs
                    .iter()
                    .map(|k| format!("<Unknown index=\"{}\"/>", k + 1))
                    .collect();
                format!("    <{tag}>{all}</{tag}>\n")
            };
            text.push_str(&list("Outputs"));
            text.push_str(&list("InitialUnknowns"));
        } else {
            for tag in ["Output", "InitialUnknown"] {
                outputs
                    .iter()
                    .for_each(|k| text.push_str(&format!("    <{tag} valueReference=\"{k}\"/>\n")));
            }
        }
        text.push_str("  </ModelStructure>\n</fmiModelDescription>\n");
        for (from, to) in &self.edits {
            assert!(text.contains(from.as_str()), "{from}");
            text = text.replacen(from, to, 1);
        }
        text
    }

    pub fn binary(&self) -> Vec<u8> {
        let folder = tempfile::tempdir().unwrap();
        let library = folder.path().join("buck.so");
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/model/buck.c");
        let mut command = Command::new("gcc");
        command.args(["-std=c99", "-O2", "-shared", "-fPIC", "-Wall", "-Wextra", "-Werror"]);
        command
            .arg(format!("-DFMI={}", self.fmi))
            .args(&self.flags)
            .arg("-o")
            .arg(&library);
        // behind the source, or the linker leaves it out
        let ran = command.arg(source).arg("-lm").output().unwrap();
        assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
        std::fs::read(library).unwrap()
    }

    pub fn members(&self) -> Vec<(String, Vec<u8>)> {
        vec![
            ("modelDescription.xml".to_owned(), self.description().into_bytes()),
            (format!("binaries/{}/buck.so", self.platform), self.binary()),
        ]
    }

    pub fn build(&self) -> Bench {
        Bench::of(&zip(&self.members()))
    }
}

/// A zip archive, written from the format's text: every member deflated.
pub fn zip(members: &[(String, Vec<u8>)]) -> Vec<u8> {
    let (mut out, mut directory) = (Vec::new(), Vec::new());
    for (name, content) in members {
        let packed = miniz_oxide::deflate::compress_to_vec(content, 6);
        let at = out.len() as u32;
        let mut common = Vec::new();
        // version 2.0, no flags, deflated, no time
        common.extend([20, 0, 0, 0, 8, 0, 0, 0, 0, 0]);
        common.extend(rawzip::crc32(content).to_le_bytes());
        common.extend((packed.len() as u32).to_le_bytes());
        common.extend((content.len() as u32).to_le_bytes());
        common.extend((name.len() as u16).to_le_bytes());
        common.extend([0, 0]);
        out.extend(b"PK\x03\x04");
        out.extend(&common);
        out.extend(name.as_bytes());
        out.extend(packed);
        directory.extend(b"PK\x01\x02\x14\x00");
        directory.extend(&common);
        directory.extend([0; 10]);
        directory.extend(at.to_le_bytes());
        directory.extend(name.as_bytes());
    }
    let (start, count) = (out.len() as u32, members.len() as u16);
    out.extend(&directory);
    out.extend(b"PK\x05\x06\0\0\0\0");
    out.extend(count.to_le_bytes());
    out.extend(count.to_le_bytes());
    out.extend((directory.len() as u32).to_le_bytes());
    out.extend(start.to_le_bytes());
    out.extend([0, 0]);
    out
}

/// The circuit of `buck.c` as a plant has it: averaged, current of both signs.
pub const CIRCUIT: &str = "[converter]\nmodel = \"averaged\"\nrectifier = \"synchronous\"\nv_in = 200.0\ninductance = 2e-3\n\
                           capacitance = 1.5e-3\nf_sw = 10e3\n";

/// Every input and output.
pub const WIRES: &str = "[fmu.inputs]\nduty = \"duty\"\nload_current = \"load.i\"\nload_conductance = \"load.g\"\nload_power = \"load.p\"\n\
                         v_in = \"source.v\"\n[fmu.outputs]\nv_out = \"out.v\"\ni_l = \"inductor.i\"\ni_out = \"out.i\"\nv_in = \"in.v\"\n\
                         [fmu.initial]\nv_out = \"v_start\"\ni_l = \"i_start\"\n\
                         [fmu.parameters]\n\"converter.inductance\" = \"L\"\n\"converter.capacitance\" = \"C\"\n";

/// A folder with an FMU.
pub struct Bench {
    pub folder: TempDir,
}

impl Bench {
    pub fn of(archive: &[u8]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("buck.fmu"), archive).unwrap();
        Self { folder }
    }

    /// A plant file beside the FMU: lines behind those of the circuit, and the `[fmu]` table.
    pub fn plant(&self, extra: &str, fmu: &str) -> PathBuf {
        let path = self.folder.path().join("plant.toml");
        std::fs::write(&path, format!("{CIRCUIT}{extra}\n[fmu]\nfile = \"buck.fmu\"\n{fmu}")).unwrap();
        path
    }

    pub fn open(&self, extra: &str, fmu: &str) -> Result<Converter, Error> {
        let path = self.plant(extra, fmu);
        Converter::open(FileName::new(&path), &[], &|file, nominal| {
            fmu::open(file, nominal, None)
        })
    }

    /// With every input and output.
    pub fn whole(&self) -> Converter {
        self.open("", WIRES).unwrap()
    }

    /// Why it cannot be opened.
    #[track_caller]
    pub fn refusal(&self, fmu: &str) -> String {
        match self.open("", fmu) {
            Ok(_) => panic!("taken"),
            Err(error) => error.to_string(),
        }
    }
}
