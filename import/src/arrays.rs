//! A pickle of named numpy arrays without an archive around it: RLlib's `module_state.pkl`, and what people dump of JAX.

use policy::NamedTensor;
use toml_input::Message;

use crate::numpy;
use crate::pickle::{Id, Item, Pickle};
use crate::torch::sound;

// a dict within a dict within ...: Flax stops at four
const DEEPEST: usize = 10;

/// The arrays by their names, those of dicts within joined by dots; `None` of a pickle that is about something else.
pub(crate) fn read(bytes: &[u8]) -> Result<Option<Vec<NamedTensor>>, Message> {
    let pickle = Pickle::read(bytes)?;
    let mut walk = Walk {
        pickle: &pickle,
        found: Vec::new(),
        left: bytes.len(),
    };
    if !matches!(pickle.item(pickle.root), Item::Dict(_) | Item::Object(_)) || walk.visit(pickle.root, "", 0)?.is_none()
    {
        return Ok(None);
    }
    walk.found.sort_by(|a, b| a.name.cmp(&b.name));
    Ok((!walk.found.is_empty()).then_some(walk.found))
}

struct Walk<'a> {
    pickle: &'a Pickle,
    found: Vec<NamedTensor>,
    /// Elements that may still be read: arrays may be shared.
    left: usize,
}

impl Walk<'_> {
    /// `None` where a value is no array and no dict of arrays.
    fn visit(&mut self, id: Id, name: &str, depth: usize) -> Result<Option<()>, Message> {
        if let Some((shape, values)) = numpy::shaped(self.pickle, id) {
            sound(name, &shape)?;
            if values.iter().any(|value| !value.is_finite()) {
                return Err(
                    Message::new(format!("the array `{name}` holds a number that is not finite"))
                        .expected("finite numbers")
                        .hint("the training has diverged, or the file was damaged"),
                );
            }
            let Some(left) = self.left.checked_sub(values.len()) else {
                return Ok(None);
            };
            self.left = left;
            self.found.push(NamedTensor {
                name: name.to_owned(),
                shape,
                values: Some(values),
            });
            return Ok(Some(()));
        }
        let entries = self.pickle.entries(id);
        // each visit costs one of the elements, so that dicts that hold one another end
        let Some(left) = self
            .left
            .checked_sub(1)
            .filter(|_| depth < DEEPEST && !entries.is_empty())
        else {
            return Ok(None);
        };
        self.left = left;
        for (key, value) in entries {
            let Some(key) = self.pickle.text(*key) else {
                return Ok(None);
            };
            let joined = if name.is_empty() {
                key.to_owned()
            } else {
                format!("{name}.{key}")
            };
            if self.visit(*value, &joined, depth + 1)?.is_none() {
                return Ok(None);
            }
        }
        Ok(Some(()))
    }
}
