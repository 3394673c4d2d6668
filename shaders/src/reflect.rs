//! What a module itself says: local size, bindings with their decorations, push constants, layouts of structs.
//!
//! Reads the few SPIR-V instructions that tests and executors ask about; anything else is passed over.

use std::collections::BTreeMap;

/// A struct with explicit offsets.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Struct {
    /// Name in the source.
    pub name: String,
    /// Name and offset of each member, bytes.
    pub members: Vec<(String, u32)>,
}

/// What a module declares.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Module {
    /// SPIR-V version, major and minor.
    pub version: (u8, u8),
    /// Numbers of the capabilities that it asks for.
    pub capabilities: Vec<u32>,
    /// Threads of a workgroup.
    pub local_size: [u32; 3],
    /// Storage buffers: (set, binding) → whether the module never writes it.
    pub buffers: BTreeMap<(u32, u32), bool>,
    /// Whether it declares push constants, and how many members of 4 bytes.
    pub push_members: usize,
    /// Structs with offsets.
    pub structs: Vec<Struct>,
}

const OP_NAME: u32 = 5;
const OP_MEMBER_NAME: u32 = 6;
const OP_EXECUTION_MODE: u32 = 16;
const OP_CAPABILITY: u32 = 17;
const OP_TYPE_STRUCT: u32 = 30;
const OP_TYPE_POINTER: u32 = 32;
const OP_VARIABLE: u32 = 59;
const OP_DECORATE: u32 = 71;
const OP_MEMBER_DECORATE: u32 = 72;
const LOCAL_SIZE: u32 = 17;
const NON_WRITABLE: u32 = 24;
const BINDING: u32 = 33;
const DESCRIPTOR_SET: u32 = 34;
const OFFSET: u32 = 35;
const STORAGE_BUFFER: u32 = 12;
const PUSH_CONSTANT: u32 = 9;

/// Everything named or decorated, by id.
#[derive(Default)]
struct Ids {
    names: BTreeMap<u32, String>,
    members: BTreeMap<(u32, u32), String>,
    offsets: BTreeMap<(u32, u32), u32>,
    decorations: BTreeMap<(u32, u32), u32>,
    struct_sizes: BTreeMap<u32, usize>,
    pointees: BTreeMap<u32, u32>,
    variables: Vec<(u32, u32, u32)>,
}

/// Reads a module; `None` when the words are no SPIR-V.
pub fn module(words: &[u32]) -> Option<Module> {
    let (&[0x0723_0203, version, _, _, _], mut rest) = words.split_first_chunk::<5>()? else { return None };
    let mut module = Module { version: ((version >> 16) as u8, (version >> 8) as u8), ..Module::default() };
    let mut ids = Ids::default();
    while let Some(&first) = rest.first() {
        let length = (first >> 16) as usize;
        let op = first & 0xffff;
        let instruction = rest.get(1..length.max(1))?;
        rest = rest.get(length.max(1)..)?;
        read(op, instruction, &mut ids, &mut module);
    }
    finish(&ids, &mut module);
    Some(module)
}

fn read(op: u32, words: &[u32], ids: &mut Ids, module: &mut Module) {
    match (op, words) {
        (OP_NAME, [id, name @ ..]) => drop(ids.names.insert(*id, text(name))),
        (OP_MEMBER_NAME, [id, at, name @ ..]) => drop(ids.members.insert((*id, *at), text(name))),
        (OP_CAPABILITY, [capability]) => module.capabilities.push(*capability),
        (OP_EXECUTION_MODE, [_, LOCAL_SIZE, x, y, z]) => module.local_size = [*x, *y, *z],
        (OP_TYPE_STRUCT, [id, members @ ..]) => drop(ids.struct_sizes.insert(*id, members.len())),
        (OP_TYPE_POINTER, [id, _, pointee]) => drop(ids.pointees.insert(*id, *pointee)),
        (OP_VARIABLE, [kind, id, class, ..]) => ids.variables.push((*kind, *id, *class)),
        (OP_DECORATE, [id, what, value @ ..]) => {
            ids.decorations.insert((*id, *what), value.first().copied().unwrap_or(0));
        }
        (OP_MEMBER_DECORATE, [id, at, OFFSET, offset]) => drop(ids.offsets.insert((*id, *at), *offset)),
        _ => {}
    }
}

fn finish(ids: &Ids, module: &mut Module) {
    for (kind, id, class) in &ids.variables {
        let decoration = |what| ids.decorations.get(&(*id, what)).copied();
        match *class {
            STORAGE_BUFFER => {
                let place = (decoration(DESCRIPTOR_SET).unwrap_or(0), decoration(BINDING).unwrap_or(0));
                module.buffers.insert(place, decoration(NON_WRITABLE).is_some());
            }
            PUSH_CONSTANT => {
                let block = ids.pointees.get(kind).and_then(|pointee| ids.struct_sizes.get(pointee));
                module.push_members = block.copied().unwrap_or(0);
            }
            _ => {}
        }
    }
    for (id, name) in &ids.names {
        let members = ids.offsets.range((*id, 0)..=(*id, u32::MAX));
        let member = |(key, offset): (&(u32, u32), &u32)| (ids.members.get(key).cloned().unwrap_or_default(), *offset);
        let members: Vec<_> = members.map(member).collect();
        if !members.is_empty() {
            module.structs.push(Struct { name: name.clone(), members });
        }
    }
}

/// A string of SPIR-V: UTF-8 in words, ended by zero.
fn text(words: &[u32]) -> String {
    let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).take_while(|b| *b != 0).collect();
    String::from_utf8_lossy(&bytes).into_owned()
}
