//! Functions of FMI by name, and those that a sampled controller refuses.

use templates::fmu::AbsentView;

use super::Fmi;

/// Types of FMI 3 with a getter and a setter of the usual form: first those that variables have.
pub const ACCESSED: [&str; 12] = [
    "Float64", "Int32", "Boolean", "Float32", "Int8", "UInt8", "Int16", "UInt16", "UInt32", "Int64", "UInt64", "String",
];

/// Those of them that no variable has.
pub fn without() -> &'static [&'static str] {
    &ACCESSED[3..]
}

const COMMON_2: &str = "GetTypesPlatform GetVersion SetDebugLogging Instantiate FreeInstance SetupExperiment \
    EnterInitializationMode ExitInitializationMode Terminate Reset GetReal GetInteger GetBoolean GetString SetReal \
    SetInteger SetBoolean SetString GetFMUstate SetFMUstate FreeFMUstate SerializedFMUstateSize SerializeFMUstate \
    DeSerializeFMUstate DoStep GetStatus GetRealStatus GetIntegerStatus GetBooleanStatus GetStringStatus";

const COMMON_3: &str = "GetVersion SetDebugLogging InstantiateModelExchange InstantiateCoSimulation \
    InstantiateScheduledExecution FreeInstance EnterInitializationMode ExitInitializationMode Terminate Reset \
    GetBinary SetBinary GetFMUState SetFMUState FreeFMUState SerializedFMUStateSize SerializeFMUState \
    DeserializeFMUState DoStep";

/// A function that is refused: name without prefix, parameters behind the instance, reason.
type Absent = (&'static str, &'static str, &'static str);

const NO_DERIVATIVE: &str = "a chosen action has no derivative";
const NOT_INTERPOLATED: &str = "outputs are held over a control period";
const NO_CLOCKS: &str = "there are no clocks";
const NO_EVENTS: &str = "there is no event mode";
const NO_STRUCTURE: &str = "there are no structural parameters";
const CONTINUOUS: &str = "this FMU is for co-simulation only";

const ABSENT_2: [Absent; 4] = [
    (
        "GetDirectionalDerivative",
        "const fmi2ValueReference unknowns[], size_t unknown_count, const fmi2ValueReference knowns[], \
         size_t known_count, const fmi2Real seed[], fmi2Real sensitivity[]",
        NO_DERIVATIVE,
    ),
    (
        "SetRealInputDerivatives",
        "const fmi2ValueReference references[], size_t count, const fmi2Integer orders[], const fmi2Real values[]",
        "inputs are sampled, not interpolated",
    ),
    (
        "GetRealOutputDerivatives",
        "const fmi2ValueReference references[], size_t count, const fmi2Integer orders[], fmi2Real values[]",
        NOT_INTERPOLATED,
    ),
    (
        "CancelStep",
        "",
        "no step is under way: fmi2DoStep ends before it returns",
    ),
];

const REFERENCES: &str = "const fmi3ValueReference references[], size_t count, ";
const DERIVATIVE: &str = "const fmi3ValueReference unknowns[], size_t unknown_count, const fmi3ValueReference knowns[], \
    size_t known_count, const fmi3Float64 seed[], size_t seed_count, fmi3Float64 sensitivity[], size_t sensitivity_count";

/// Parameters that begin with `*` stand behind those of [`REFERENCES`].
const ABSENT_3: [Absent; 32] = [
    ("GetClock", "*fmi3Clock values[]", NO_CLOCKS),
    ("SetClock", "*const fmi3Clock values[]", NO_CLOCKS),
    (
        "GetIntervalDecimal",
        "*fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[]",
        NO_CLOCKS,
    ),
    (
        "GetIntervalFraction",
        "*fmi3UInt64 counters[], fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[]",
        NO_CLOCKS,
    ),
    ("GetShiftDecimal", "*fmi3Float64 shifts[]", NO_CLOCKS),
    (
        "GetShiftFraction",
        "*fmi3UInt64 counters[], fmi3UInt64 resolutions[]",
        NO_CLOCKS,
    ),
    ("SetIntervalDecimal", "*const fmi3Float64 intervals[]", NO_CLOCKS),
    (
        "SetIntervalFraction",
        "*const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]",
        NO_CLOCKS,
    ),
    ("SetShiftDecimal", "*const fmi3Float64 shifts[]", NO_CLOCKS),
    (
        "SetShiftFraction",
        "*const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]",
        NO_CLOCKS,
    ),
    (
        "ActivateModelPartition",
        "fmi3ValueReference clock, fmi3Float64 time",
        NO_CLOCKS,
    ),
    ("EnterEventMode", "", NO_EVENTS),
    ("EvaluateDiscreteStates", "", NO_EVENTS),
    (
        "UpdateDiscreteStates",
        "fmi3Boolean *again, fmi3Boolean *terminate, fmi3Boolean *nominals, fmi3Boolean *values, fmi3Boolean *has_next, \
         fmi3Float64 *next",
        NO_EVENTS,
    ),
    ("EnterStepMode", "", NO_EVENTS),
    ("EnterConfigurationMode", "", NO_STRUCTURE),
    ("ExitConfigurationMode", "", NO_STRUCTURE),
    (
        "GetNumberOfVariableDependencies",
        "fmi3ValueReference reference, size_t *count",
        "every output depends on every input",
    ),
    (
        "GetVariableDependencies",
        "fmi3ValueReference dependent, size_t elements[], fmi3ValueReference independents[], size_t others[], \
         fmi3DependencyKind kinds[], size_t count",
        "every output depends on every input",
    ),
    ("GetDirectionalDerivative", DERIVATIVE, NO_DERIVATIVE),
    ("GetAdjointDerivative", DERIVATIVE, NO_DERIVATIVE),
    (
        "GetOutputDerivatives",
        "*const fmi3Int32 orders[], fmi3Float64 values[], size_t value_count",
        NOT_INTERPOLATED,
    ),
    ("EnterContinuousTimeMode", "", CONTINUOUS),
    (
        "CompletedIntegratorStep",
        "fmi3Boolean no_return, fmi3Boolean *event, fmi3Boolean *terminate",
        CONTINUOUS,
    ),
    ("SetTime", "fmi3Float64 time", CONTINUOUS),
    (
        "SetContinuousStates",
        "const fmi3Float64 states[], size_t count",
        CONTINUOUS,
    ),
    (
        "GetContinuousStateDerivatives",
        "fmi3Float64 values[], size_t count",
        CONTINUOUS,
    ),
    ("GetEventIndicators", "fmi3Float64 values[], size_t count", CONTINUOUS),
    ("GetContinuousStates", "fmi3Float64 values[], size_t count", CONTINUOUS),
    (
        "GetNominalsOfContinuousStates",
        "fmi3Float64 values[], size_t count",
        CONTINUOUS,
    ),
    ("GetNumberOfEventIndicators", "size_t *count", CONTINUOUS),
    ("GetNumberOfContinuousStates", "size_t *count", CONTINUOUS),
];

fn table(fmi: Fmi) -> &'static [Absent] {
    match fmi {
        Fmi::Two => &ABSENT_2,
        Fmi::Three => &ABSENT_3,
    }
}

/// Names of all functions that the standard has for co-simulation (FMI 2) or at all (FMI 3).
pub fn all(fmi: Fmi) -> Vec<String> {
    let common = match fmi {
        Fmi::Two => COMMON_2,
        Fmi::Three => COMMON_3,
    };
    let access = match fmi {
        Fmi::Two => &[][..],
        Fmi::Three => &ACCESSED,
    };
    let access = access
        .iter()
        .flat_map(|name| ["Get", "Set"].map(|verb| format!("{verb}{name}")));
    let absent = table(fmi).iter().map(|(name, ..)| (*name).to_owned());
    let names = common.split_ascii_whitespace().map(str::to_owned);
    let names = names.chain(access).chain(absent);
    names.map(|name| format!("{}{name}", fmi.name())).collect()
}

/// The functions that are refused.
pub fn absent(fmi: Fmi) -> Vec<AbsentView> {
    table(fmi).iter().map(|entry| view(fmi, *entry)).collect()
}

fn view(fmi: Fmi, (name, parameters, reason): Absent) -> AbsentView {
    let parameters = match parameters.strip_prefix('*') {
        Some(rest) => format!("{REFERENCES}{rest}"),
        None => parameters.to_owned(),
    };
    // parameters are written once and taken apart: a stub names each, to say that it is not used
    let list: Vec<&str> = parameters.split(", ").filter(|part| !part.is_empty()).collect();
    let name_of = |parameter: &str| {
        let word = parameter.rsplit([' ', '*']).next().unwrap_or_default();
        word.trim_end_matches("[]").to_owned()
    };
    AbsentView {
        name: format!("{}{name}", fmi.name()),
        names: list.iter().map(|parameter| name_of(parameter)).collect(),
        parameters: list.iter().map(|parameter| format!(", {parameter}")).collect(),
        reason,
    }
}
