//! FMUs as converters: only if the command line allows it.

use closed_loop::Error;
use closed_loop::outside::Outside;
use plant::Parameters;
use toml_input::{FileName, Message};

use crate::arguments::Foreign;
use crate::talk;

/// What opens the converter that a plant's file names beside its numbers.
pub fn opener(allowed: Foreign) -> impl Fn(&FileName, &Parameters) -> Result<Box<dyn Outside>, Error> {
    move |file, nominal| {
        if !allowed.run_fmu {
            let message = Message::new("this converter is an FMU, which is foreign native code");
            let hint = "--run-fmu runs it in this process and with your rights: give it if you trust who made the FMU";
            return Err(file.fault(message.hint(hint)).into());
        }
        let tell: fmu::Tell = talk::tell;
        fmu::open(file, nominal, talk::is_verbose().then_some(tell))
    }
}
