//! Files of the S-function, all made of the same view.

use askama::Template;

use crate::block::BlockView;

macro_rules! files {
    ($($(#[$doc:meta])* $name:ident = $path:literal;)*) => {$(
        $(#[$doc])*
        #[derive(Debug, Template)]
        #[template(path = $path, escape = "none")]
        pub struct $name<'a> {
            /// The block.
            pub b: &'a BlockView,
        }
    )*};
}

files! {
    /// `sf_<name>.c`
    Source = "sfunction/sf.c.jinja";
    /// `sf_<name>.tlc`
    Tlc = "sfunction/sf.tlc.jinja";
    /// `make_<name>.m`
    Make = "sfunction/make.m.jinja";
    /// `rtwmakecfg.m`
    Rtwmakecfg = "sfunction/rtwmakecfg.m.jinja";
    /// `<name>_usr.mk`
    UserMakefile = "sfunction/usr.mk.jinja";
    /// `legacy_<name>.m`
    LegacyCode = "sfunction/legacy.m.jinja";
    /// `<name>_caller.h`
    CallerHeader = "sfunction/caller.h.jinja";
    /// `<name>_caller.c`
    CallerSource = "sfunction/caller.c.jinja";
    /// `README_sfunction.md`
    Readme = "sfunction/readme.md.jinja";
}
