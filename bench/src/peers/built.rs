//! The peers that a registry has, built around the network.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use policy::Policy;
use targets::{CCompiler, RustTarget, TargetSpec};

use crate::build::{Bench, run};
use crate::row::{Failure, Row};
use crate::sources;

/// Python packages that write the network for the peers.
const PACKAGES: [&str; 5] = [
    "emlearn==0.23.2",
    "flatbuffers==25.12.19",
    "numpy==2.4.6",
    "onnx==1.23.2",
    "tflite==2.18.0",
];

/// Somebody's kernel, built here.
struct Peer {
    /// With version and numeric format.
    name: &'static str,
    compiler: &'static str,
    /// Statements before the first inference.
    start: &'static str,
    /// Largest error of a Q value, as a share of the observation's largest.
    limit: f64,
    /// Builds the function `peer_q_values`; what the linker needs for it.
    build: fn(&Site) -> Result<Vec<String>, Failure>,
}

const PEERS: [Peer; 4] = [
    Peer {
        name: "MicroFlow 0.1.3 int8",
        compiler: "rustc -O3, LTO",
        start: "",
        limit: 0.1,
        build: micro_flow,
    },
    Peer {
        name: "emlearn 0.23.2 f32",
        compiler: "gcc -O2",
        start: "",
        limit: 1e-4,
        build: emlearn,
    },
    Peer {
        name: "burn-onnx 0.22.0 f32, ndarray",
        compiler: "rustc -O3, LTO",
        start: "void peer_start(void); peer_start();",
        limit: 1e-4,
        build: |site| burn_onnx(site, "ndarray", BURN_NDARRAY),
    },
    Peer {
        name: "burn-onnx 0.22.0 f32, flex",
        compiler: "rustc -O3, LTO",
        start: "void peer_start(void); peer_start();",
        limit: 1e-4,
        build: |site| burn_onnx(site, "flex", BURN_FLEX),
    },
];

/// Where and for what peers are built.
struct Site<'a> {
    bench: &'a Bench,
    policy: &'a Policy,
    gcc: &'a CCompiler,
    rust: RustTarget,
    folder: PathBuf,
    python: PathBuf,
}

/// Peers that could be built; of the others standard error says why not.
pub fn rows(bench: &Bench, policy: &Policy, target: &TargetSpec, root: &Path) -> Vec<Row> {
    let note = |name: &str, failure: Failure| eprintln!("note: {name} is not measured: {failure}");
    let site = match Site::new(bench, policy, target, root) {
        Ok(site) => site,
        Err(failure) => {
            note("no peer", failure);
            return Vec::new();
        }
    };
    let mut rows = Vec::new();
    for peer in &PEERS {
        match site.measured(peer, target) {
            Ok(row) => rows.push(row),
            Err(failure) => note(peer.name, failure),
        }
    }
    rows
}

impl<'a> Site<'a> {
    fn new(bench: &'a Bench, policy: &'a Policy, target: &'a TargetSpec, root: &Path) -> Result<Self, Failure> {
        let (Some(gcc), Some(rust)) = (target.c_compilers.first(), target.rust) else {
            return Err(Failure(format!("{} has no compilers", target.name)));
        };
        let folder = folder()?;
        let python = environment(&folder)?;
        run(Command::new(&python)
            .arg(root.join("bench/peers/models.py"))
            .arg(root.join("bench/policy/weights.safetensors"))
            .arg(&folder))?;
        Ok(Self {
            bench,
            policy,
            gcc,
            rust,
            folder,
            python,
        })
    }

    fn measured(&self, peer: &Peer, target: &TargetSpec) -> Result<Row, Failure> {
        let bench = self.bench;
        bench.put_naive(self.policy)?;
        // what board, counting and the network to compare with take is not the peer's
        bench.put("main.c", &sources::peer_main(self.policy, "", peer.limit))?;
        let itself = "#include \"naive.h\"\nvoid peer_q_values(const float *o, float *q) { naive_q_values(o, q); }\n";
        bench.put("itself.c", itself)?;
        bench.object(self.gcc, "-O2", "itself.c", &[])?;
        bench.counted(target, &["unit.o"], &["main.c", "naive.c"])?;
        let board = bench.linked_flash(target)?;

        bench.put("main.c", &sources::peer_main(self.policy, peer.start, peer.limit))?;
        let units = (peer.build)(self)?;
        let units: Vec<&str> = units.iter().map(String::as_str).collect();
        let found = bench.counted(target, &units, &["main.c", "naive.c"])?;
        Ok(Row {
            compiler: peer.compiler.to_owned(),
            flash: Some(bench.linked_flash(target)?.saturating_sub(board)),
            q_values: found.q_values,
            stack: found.stack,
            checksum: found.checksum,
            ..super::row(peer.name, target)
        })
    }

    /// Builds a package of this name in a folder of its own; returns the library.
    fn package(&self, name: &str, dependencies: &str, files: &[(&str, String)]) -> Result<Vec<String>, Failure> {
        let package = self.folder.join(name);
        let failed = |error: std::io::Error| Failure(format!("{}: {error}", package.display()));
        std::fs::create_dir_all(package.join("src")).map_err(failed)?;
        std::fs::write(package.join("Cargo.toml"), manifest(name, dependencies)).map_err(failed)?;
        for (file, text) in files {
            std::fs::write(package.join(file), text).map_err(failed)?;
        }
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        let target = self.folder.join("target");
        run(Command::new(cargo)
            .current_dir(&package)
            .args(["build", "--release", "--target", self.rust.triple])
            .env("RUSTFLAGS", self.rust.machine_flags.join(" "))
            .env("CARGO_TARGET_DIR", &target)
            .stderr(Stdio::inherit()))?;
        let library = target
            .join(self.rust.triple)
            .join(format!("release/lib{}.a", name.replace('-', "_")));
        Ok(vec![library.display().to_string()])
    }

    /// Parameters of `peer_q_values` in Rust.
    fn parameters(&self) -> String {
        let (features, actions) = (self.policy.features.len(), self.policy.outputs());
        format!("o: *const [f32; {features}], q: *mut [f32; {actions}]")
    }
}

/// Beside the programs of the workspace.
fn folder() -> Result<PathBuf, Failure> {
    let program = std::env::current_exe().map_err(|error| Failure(error.to_string()))?;
    let folder = program.ancestors().nth(2).unwrap_or(Path::new(".")).join("peers");
    std::fs::create_dir_all(&folder).map_err(|error| Failure(error.to_string()))?;
    Ok(folder)
}

/// A virtual environment with [`PACKAGES`]; returns its Python.
fn environment(folder: &Path) -> Result<PathBuf, Failure> {
    let environment = folder.join("python");
    let python = environment.join("bin/python");
    if !python.exists() {
        run(Command::new("python3").args(["-m", "venv"]).arg(&environment))?;
    }
    let pip = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check"];
    run(Command::new(&python).args(pip).args(PACKAGES))?;
    Ok(python)
}

fn emlearn(site: &Site) -> Result<Vec<String>, Failure> {
    let text = format!(
        "#include \"{}\"\nvoid peer_q_values(const float *o, float *q)\n{{\n    (void)network_regress(o, {}, q, {});\n}}\n",
        site.folder.join("emlearn.h").display(),
        site.policy.features.len(),
        site.policy.outputs()
    );
    site.bench.put("emlearn.c", &text)?;
    let code = "import emlearn, os; print(os.path.dirname(emlearn.__file__))";
    let headers = run(Command::new(&site.python).args(["-c", code]))?;
    let include = format!("-I{}", String::from_utf8_lossy(&headers).trim());
    site.bench
        .object(site.gcc, "-O2", "emlearn.c", &["-ffunction-sections", &include])?;
    Ok(["unit.o", "-lm", "-lc"].map(str::to_owned).to_vec())
}

fn micro_flow(site: &Site) -> Result<Vec<String>, Failure> {
    let code = format!(
        r#"#![no_std]
use microflow::buffer::Buffer2D;
use microflow::model;
#[model("{}")]
struct Network;
{PANIC}
#[no_mangle]
pub unsafe extern "C" fn peer_q_values({}) {{
    let o = &*o;
    let y = Network::predict(Buffer2D::from_fn(|_, i| o[i]));
    *q = core::array::from_fn(|n| y[n]);
}}
"#,
        site.folder.join("network.tflite").display(),
        site.parameters()
    );
    let dependencies = r#"microflow = "=0.1.3"
nalgebra = { version = "=0.32.6", default-features = false, features = ["macros"] }
"#;
    site.package("microflow-peer", dependencies, &[("src/lib.rs", code)])
}

/// What burn computes with on a microcontroller: the backend that it recommends, and the one before, which needs a crate for
/// atomics of 64 bits beside.
const BURN_FLEX: &str =
    r#"burn-flex = { version = "=0.22.1", default-features = false, features = ["critical-section"] }"#;
const BURN_NDARRAY: &str = r#"burn-ndarray = { version = "=0.22.1", default-features = false }
portable-atomic = { version = "=1.15.0", features = ["critical-section"] }"#;

/// The model is made once, at the start; an inference has the floats of the observation and leaves those of the Q values.
fn burn_onnx(site: &Site, backend: &str, crates: &str) -> Result<Vec<String>, Failure> {
    eprintln!("note: burn-onnx with {backend} takes many minutes to build the first time");
    let code = format!(
        r#"#![no_std]
extern crate alloc;
#[allow(dead_code)]
mod network {{
    include!(concat!(env!("OUT_DIR"), "/network/network.rs"));
}}
use burn::tensor::{{Device, Tensor, TensorData}};
use core::mem::MaybeUninit;
use embedded_alloc::LlffHeap;
use network::Model;

const HEAP_BYTES: usize = 512 * 1024;
#[global_allocator]
static HEAP: LlffHeap = LlffHeap::empty();
static mut MEMORY: [MaybeUninit<u8>; HEAP_BYTES] = [MaybeUninit::uninit(); HEAP_BYTES];
static mut MODEL: Option<(Model, Device)> = None;
{PANIC}
/// One core and no interrupt.
struct Alone;
critical_section::set_impl!(Alone);
unsafe impl critical_section::Impl for Alone {{
    unsafe fn acquire() -> critical_section::RawRestoreState {{}}
    unsafe fn release(_: critical_section::RawRestoreState) {{}}
}}
#[no_mangle]
pub unsafe extern "C" fn peer_start() {{
    HEAP.init(&raw mut MEMORY as usize, HEAP_BYTES);
    let device = Device::default();
    *(&raw mut MODEL) = Some((Model::from_embedded(&device), device));
}}
#[no_mangle]
pub unsafe extern "C" fn peer_q_values({}) {{
    let Some((model, device)) = &*(&raw const MODEL) else {{ return }};
    let x = Tensor::<2>::from_data(TensorData::new((*o).to_vec(), [1, {}]), device);
    if let Ok(y) = model.forward(x).into_data().as_slice::<f32>() {{
        (*q).copy_from_slice(y);
    }}
}}
"#,
        site.parameters(),
        site.policy.features.len()
    );
    let script = format!(
        r#"fn main() {{
    let mut model = burn_onnx::ModelGen::new();
    model.input({:?}).out_dir("network/").load_strategy(burn_onnx::LoadStrategy::Embedded).run_from_script();
}}
"#,
        site.folder.join("network.onnx").display().to_string()
    );
    let dependencies = format!(
        r#"burn = {{ version = "=0.22.1", default-features = false, features = ["{backend}"] }}
burn-store = {{ version = "=0.22.1", default-features = false }}
critical-section = "=1.2.0"
embedded-alloc = "=0.7.0"
{crates}
[build-dependencies]
burn-onnx = "=0.22.0"
"#
    );
    let files = [("build.rs", script), ("src/lib.rs", code)];
    site.package(&format!("burn-{backend}-peer"), &dependencies, &files)
}

/// For a library without `std`.
const PANIC: &str = r#"extern "C" {
    fn board_exit(code: i32);
}
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    unsafe { board_exit(9) }
    loop {}
}"#;

/// Of a package that is not a member of the workspace.
fn manifest(name: &str, dependencies: &str) -> String {
    format!(
        r#"[package]
name = "{name}"
version = "0.0.0"
edition = "2021"
[workspace]
[lib]
crate-type = ["staticlib"]
[profile.release]
opt-level = 3
lto = true
panic = "abort"
codegen-units = 1
[dependencies]
{dependencies}"#
    )
}
