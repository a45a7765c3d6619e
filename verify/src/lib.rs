//! Differential check: generated code against the interpreter, step by step.
