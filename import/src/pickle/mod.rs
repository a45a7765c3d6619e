//! A reader of pickles that builds data and calls nothing.
//!
//! A pickle is a program for a stack machine. Two of its operations let Python run code: REDUCE calls a function that the file
//! names, BUILD hands an object its state. Here both only write down what was asked for: a [`Item::Object`] holds the name of
//! its class or function, its arguments and its state. Whoever knows the name reads them. A function that builds no
//! data is refused by its name, since a file that asks for it is not what it says it is.

mod machine;

use toml_input::Message;

use machine::Machine;

/// Index of an item.
pub(crate) type Id = usize;

/// One value of a pickle.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Item {
    None,
    Bool(bool),
    Int(i64),
    Float(f64),
    Text(String),
    Bytes(Vec<u8>),
    /// List, tuple or set.
    List(Vec<Id>),
    Dict(Vec<(Id, Id)>),
    /// A class or function by `module.name`.
    Global(String),
    /// What a class or function would have made.
    Object(Object),
    /// What lies outside the pickle: torch's storages.
    Persistent(Id),
}

/// What would have been made, written down.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Object {
    /// `module.name` of the class or function.
    pub class: String,
    /// The tuple of its arguments.
    pub arguments: Id,
    pub state: Option<Id>,
    pub entries: Vec<(Id, Id)>,
}

/// A pickle that was read.
#[derive(Debug)]
pub(crate) struct Pickle {
    items: Vec<Item>,
    /// What the pickle is about.
    pub root: Id,
}

impl Pickle {
    /// Reads the first pickle of `bytes`.
    pub fn read(bytes: &[u8]) -> Result<Self, Message> {
        let (items, root) = Machine::new(bytes).run()?;
        Ok(Pickle { items, root })
    }

    /// An item.
    pub fn item(&self, id: Id) -> &Item {
        self.items.get(id).unwrap_or(&Item::None)
    }

    pub fn text(&self, id: Id) -> Option<&str> {
        match self.item(id) {
            Item::Text(text) => Some(text),
            _ => None,
        }
    }

    /// A whole number that is not negative.
    pub fn size(&self, id: Id) -> Option<usize> {
        match self.item(id) {
            Item::Int(number) => usize::try_from(*number).ok(),
            _ => None,
        }
    }

    pub fn number(&self, id: Id) -> Option<f64> {
        match self.item(id) {
            Item::Int(number) => Some(*number as f64),
            Item::Float(number) => Some(*number),
            Item::Bool(yes) => Some(f64::from(u8::from(*yes))),
            _ => None,
        }
    }

    pub fn list(&self, id: Id) -> Option<&[Id]> {
        match self.item(id) {
            Item::List(list) => Some(list),
            _ => None,
        }
    }

    /// Keys and values of a dict, or of an object that stands for one.
    pub fn entries(&self, id: Id) -> &[(Id, Id)] {
        match self.item(id) {
            Item::Dict(entries) => entries,
            Item::Object(object) => &object.entries,
            _ => &[],
        }
    }

    /// The attributes of an object: its state, which may be a pair of a dict and slots.
    pub fn attributes(&self, id: Id) -> &[(Id, Id)] {
        let Item::Object(Object { state: Some(state), .. }) = self.item(id) else {
            return &[];
        };
        self.entries(*state)
    }

    /// The value at a key.
    pub fn get(&self, entries: &[(Id, Id)], key: &str) -> Option<Id> {
        let found = entries.iter().find(|(found, _)| self.text(*found) == Some(key));
        found.map(|(_, value)| *value)
    }
}
