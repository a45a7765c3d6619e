//! askama templates and their view structs: layout only.
