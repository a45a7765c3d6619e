//! The stack machine of pickles: some forty operations that build items, and none that calls.

use std::collections::BTreeMap;

use toml_input::Message;

use super::{Id, Item, Object};

// an item takes a byte of the file and some fifty of memory: a saved policy has some thousand
const MOST_ITEMS: usize = 100_000;
// operations that build nothing, too, take their time: four for each item are more than any pickler writes
const MOST_STEPS: usize = 400_000;

/// Functions that build data and do nothing else.
const BUILDERS: [&str; 35] = [
    "__builtin__.bytearray",
    "__builtin__.complex",
    "__builtin__.set",
    "_codecs.encode",
    "argparse.Namespace",
    "builtins.bytearray",
    "builtins.complex",
    "builtins.frozenset",
    "builtins.range",
    "builtins.set",
    "builtins.slice",
    "collections.OrderedDict",
    "collections.defaultdict",
    "collections.deque",
    "copy_reg._reconstructor",
    "copyreg._reconstructor",
    "numpy._core.multiarray._reconstruct",
    "numpy._core.multiarray.scalar",
    "numpy._core.numeric._frombuffer",
    "numpy.core.multiarray._reconstruct",
    "numpy.core.multiarray.scalar",
    "numpy.core.numeric._frombuffer",
    "numpy.dtype",
    "numpy.ndarray",
    "numpy.random._pickle.__bit_generator_ctor",
    "numpy.random._pickle.__generator_ctor",
    "numpy.random._pickle.__randomstate_ctor",
    "numpy.random.bit_generator.__pyx_unpickle_SeedSequence",
    "torch.Size",
    "torch._tensor._rebuild_from_type_v2",
    "torch._utils._rebuild_parameter",
    "torch._utils._rebuild_parameter_with_state",
    "torch._utils._rebuild_tensor",
    "torch._utils._rebuild_tensor_v2",
    "torch.device",
];

/// The stack machine.
pub(super) struct Machine<'a> {
    bytes: &'a [u8],
    at: usize,
    items: Vec<Item>,
    stack: Vec<Id>,
    marks: Vec<usize>,
    memo: BTreeMap<u64, Id>,
}

impl<'a> Machine<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Machine {
            bytes,
            at: 0,
            items: Vec::new(),
            stack: Vec::new(),
            marks: Vec::new(),
            memo: BTreeMap::new(),
        }
    }

    /// Runs the program to its end: all items, and the one that it is about.
    pub fn run(mut self) -> Result<(Vec<Item>, Id), Message> {
        for _ in 0..MOST_STEPS {
            let operation = self.byte()?;
            if operation == b'.' {
                let root = self.pop()?;
                return Ok((self.items, root));
            }
            self.step(operation)?;
        }
        Err(refused(&format!("more than {MOST_STEPS} operations")))
    }

    fn step(&mut self, operation: u8) -> Result<(), Message> {
        match operation {
            0x80 => drop(self.byte()?),
            0x95 => drop(self.take(8)?),
            b'(' => self.marks.push(self.stack.len()),
            b'0' => drop(self.pop()?),
            b'1' => drop(self.since_mark()?),
            b'2' => {
                let top = self.top()?;
                self.stack.push(top);
            }
            b'N' => self.push(Item::None)?,
            0x88 => self.push(Item::Bool(true))?,
            0x89 => self.push(Item::Bool(false))?,
            b'K' | b'M' | b'J' | b'I' | b'L' | 0x8a | 0x8b | b'G' | b'F' => self.numbers(operation)?,
            b'X' | 0x8c | 0x8d | b'V' | b'B' | b'C' | 0x8e | 0x96 | b'U' | b'T' => self.texts(operation)?,
            b']' | b')' | 0x8f => self.push(Item::List(Vec::new()))?,
            b'l' | b't' | 0x91 => {
                let items = self.since_mark()?;
                self.push(Item::List(items))?;
            }
            0x85..=0x87 => {
                let count = usize::from(operation - 0x84);
                let from = self.stack.len().checked_sub(count).ok_or_else(cut_off)?;
                let items = self.stack.split_off(from);
                self.push(Item::List(items))?;
            }
            b'}' => self.push(Item::Dict(Vec::new()))?,
            b'd' => {
                let items = self.since_mark()?;
                self.push(Item::Dict(pairs(&items)))?;
            }
            b'a' => {
                let item = self.pop()?;
                self.append(&[item])?;
            }
            b'e' | 0x90 => {
                let items = self.since_mark()?;
                self.append(&items)?;
            }
            b's' => {
                let (value, key) = (self.pop()?, self.pop()?);
                self.insert(&[key, value])?;
            }
            b'u' => {
                let items = self.since_mark()?;
                self.insert(&items)?;
            }
            b'g' | b'h' | b'j' | b'p' | b'q' | b'r' | 0x94 => self.memory(operation)?,
            b'c' | 0x93 | b'R' | 0x81 | 0x92 | b'b' | b'Q' => self.objects(operation)?,
            other => return Err(refused(&format!("operation 0x{other:02x}"))),
        }
        Ok(())
    }

    fn numbers(&mut self, operation: u8) -> Result<(), Message> {
        let item = match operation {
            b'K' => Item::Int(self.byte()?.into()),
            b'M' => Item::Int(u16::from_le_bytes(self.array()?).into()),
            b'J' => Item::Int(i32::from_le_bytes(self.array()?).into()),
            b'G' => Item::Float(f64::from_be_bytes(self.array()?)),
            0x8a | 0x8b => {
                let length = if operation == 0x8a {
                    self.byte()?.into()
                } else {
                    self.u32()?
                };
                let bytes = self.take(length)?;
                // beyond 64 bits are seeds of random numbers, which nobody asks for
                long(bytes).map_or(Item::None, Item::Int)
            }
            _ => {
                let line = self.line()?;
                let number = line.trim_end_matches('L');
                match (operation, line, number.parse::<i64>()) {
                    (b'I', "00", _) => Item::Bool(false),
                    (b'I', "01", _) => Item::Bool(true),
                    (b'F', ..) => Item::Float(number.parse().map_err(|_| refused("a number that is none"))?),
                    (.., Ok(number)) => Item::Int(number),
                    _ => Item::None,
                }
            }
        };
        self.push(item)
    }

    fn texts(&mut self, operation: u8) -> Result<(), Message> {
        if operation == b'V' {
            let line = self.line()?.to_owned();
            return self.push(Item::Text(line));
        }
        let length = match operation {
            0x8c | b'C' | b'U' => self.byte()?.into(),
            b'X' | b'B' | b'T' => self.u32()?,
            _ => usize::try_from(u64::from_le_bytes(self.array()?)).map_err(|_| cut_off())?,
        };
        let bytes = self.take(length)?;
        let is_text = matches!(operation, b'X' | 0x8c | 0x8d);
        let item = match (is_text, std::str::from_utf8(bytes)) {
            (true, Ok(text)) => Item::Text(text.to_owned()),
            (true, Err(_)) => return Err(refused("a text that is not UTF-8")),
            (false, _) => Item::Bytes(bytes.to_vec()),
        };
        self.push(item)
    }

    fn memory(&mut self, operation: u8) -> Result<(), Message> {
        let key = match operation {
            0x94 => self.memo.len() as u64,
            b'h' | b'q' => self.byte()?.into(),
            b'j' | b'r' => self.u32()? as u64,
            _ => self.line()?.parse().map_err(|_| refused("a memo that is no number"))?,
        };
        if matches!(operation, b'g' | b'h' | b'j') {
            let id = self.memo.get(&key).copied();
            self.stack
                .push(id.ok_or_else(|| refused("a value that was not remembered"))?);
        } else {
            let top = self.top()?;
            self.memo.insert(key, top);
        }
        Ok(())
    }

    fn objects(&mut self, operation: u8) -> Result<(), Message> {
        match operation {
            b'c' => {
                let (module, name) = (self.line()?.to_owned(), self.line()?.to_owned());
                self.push(Item::Global(format!("{module}.{name}")))
            }
            0x93 => {
                let (name, module) = (self.pop()?, self.pop()?);
                match (self.items.get(module), self.items.get(name)) {
                    (Some(Item::Text(module)), Some(Item::Text(name))) => {
                        let global = format!("{module}.{name}");
                        self.push(Item::Global(global))
                    }
                    _ => Err(refused("a class without a name")),
                }
            }
            b'R' | 0x81 => {
                let (arguments, class) = (self.pop()?, self.pop()?);
                self.object(class, arguments, operation == b'R')
            }
            0x92 => {
                let (_, arguments, class) = (self.pop()?, self.pop()?, self.pop()?);
                self.object(class, arguments, false)
            }
            b'b' => {
                let state = self.pop()?;
                let id = self.top()?;
                if let Some(Item::Object(object)) = self.items.get_mut(id) {
                    object.state = Some(state);
                }
                Ok(())
            }
            _ => {
                let id = self.pop()?;
                self.push(Item::Persistent(id))
            }
        }
    }

    /// Writes down a call, or the making of an object; a call must be of a builder.
    fn object(&mut self, class: Id, arguments: Id, is_call: bool) -> Result<(), Message> {
        let Some(Item::Global(class)) = self.items.get(class).cloned() else {
            return Err(refused("a call of what is no class"));
        };
        if is_call && !BUILDERS.contains(&class.as_str()) {
            return Err(Message::new("the file asks for a call that builds no data; nothing was run")
                .found(format!("`{}`", class.escape_debug()))
                .expected("tensors, dicts, lists, numbers and texts")
                .hint(
                    "a file from elsewhere that asks for this is not to be opened with Python; your own saves hold none of it as \
                     torch.save(net.state_dict(), \"weights.pt\")",
                ));
        }
        self.push(Item::Object(Object {
            class,
            arguments,
            state: None,
            entries: Vec::new(),
        }))
    }

    fn append(&mut self, items: &[Id]) -> Result<(), Message> {
        let id = self.top()?;
        // what else takes elements, such as a deque, is nobody's business here
        if let Some(Item::List(list)) = self.items.get_mut(id) {
            list.extend(items);
        }
        Ok(())
    }

    fn insert(&mut self, items: &[Id]) -> Result<(), Message> {
        let id = self.top()?;
        match self.items.get_mut(id) {
            Some(Item::Dict(entries) | Item::Object(Object { entries, .. })) => entries.extend(pairs(items)),
            _ => return Err(refused("entries of what is no dict")),
        }
        Ok(())
    }

    fn push(&mut self, item: Item) -> Result<(), Message> {
        if self.items.len() >= MOST_ITEMS {
            return Err(refused(&format!("more than {MOST_ITEMS} values")));
        }
        self.stack.push(self.items.len());
        self.items.push(item);
        Ok(())
    }

    fn pop(&mut self) -> Result<Id, Message> {
        self.stack.pop().ok_or_else(cut_off)
    }

    fn top(&self) -> Result<Id, Message> {
        self.stack.last().copied().ok_or_else(cut_off)
    }

    fn since_mark(&mut self) -> Result<Vec<Id>, Message> {
        let from = self.marks.pop().filter(|from| *from <= self.stack.len());
        Ok(self.stack.split_off(from.ok_or_else(cut_off)?))
    }

    fn byte(&mut self) -> Result<u8, Message> {
        self.array::<1>().map(|[byte]| byte)
    }

    fn u32(&mut self) -> Result<usize, Message> {
        let number = u32::from_le_bytes(self.array()?);
        usize::try_from(number).map_err(|_| cut_off())
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], Message> {
        let bytes = self.take(N)?;
        bytes.first_chunk::<N>().copied().ok_or_else(cut_off)
    }

    fn take(&mut self, length: usize) -> Result<&[u8], Message> {
        let end = self.at.checked_add(length).ok_or_else(cut_off)?;
        let bytes = self.bytes.get(self.at..end).ok_or_else(cut_off)?;
        self.at = end;
        Ok(bytes)
    }

    fn line(&mut self) -> Result<&str, Message> {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        let length = rest.iter().position(|&byte| byte == b'\n').ok_or_else(cut_off)?;
        self.at += length + 1;
        let line = rest.get(..length).unwrap_or_default();
        std::str::from_utf8(line).map_err(|_| refused("a line that is not UTF-8"))
    }
}

fn pairs(items: &[Id]) -> Vec<(Id, Id)> {
    items
        .as_chunks::<2>()
        .0
        .iter()
        .map(|[key, value]| (*key, *value))
        .collect()
}

/// A little-endian number in two's complement.
fn long(bytes: &[u8]) -> Option<i64> {
    let sign = bytes.last().is_some_and(|last| *last >= 0x80);
    let mut full = if sign { [0xff; 8] } else { [0; 8] };
    full.get_mut(..bytes.len())?.copy_from_slice(bytes);
    Some(i64::from_le_bytes(full))
}

fn cut_off() -> Message {
    refused("a program that ends in the middle")
}

fn refused(found: &str) -> Message {
    Message::new("this is not a pickle that can be read")
        .found(found)
        .expected("what torch.save or pickle.dump writes of tensors, dicts, lists, numbers and texts")
        .hint("save the network alone: torch.save(net.state_dict(), \"weights.pt\")")
}
