//! lower: Policy + TargetSpec -> Program; backends: Program -> GeneratedFiles.
