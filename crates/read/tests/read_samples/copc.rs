//! COPC, made in memory.

use super::las;
use std::io::Cursor;

/// [`las`] of format 7 as COPC: so many points on each level, a chunk each. The last level has a page of the hierarchy of its own.
pub(crate) fn copc(levels: &[i32]) -> Vec<u8> {
    let plain = las(7, levels.iter().sum(), false);
    let word = |at: usize| u32::from_le_bytes(plain[at..at + 4].try_into().unwrap());
    let header = word(94) as usize & 0xffff;
    let points = word(96) as usize;
    let record = word(105) as usize & 0xffff;
    let vlr = laz::LazVlrBuilder::default().with_point_format(7, 0).unwrap().with_variable_chunk_size().build();
    let mut description = Vec::new();
    vlr.write_to(&mut description).unwrap();
    let record_of = |user: &str, id: u16, data: &[u8]| {
        let mut head = vec![0; 54];
        head[2..2 + user.len()].copy_from_slice(user.as_bytes());
        head[18..20].copy_from_slice(&id.to_le_bytes());
        head[20..22].copy_from_slice(&(data.len() as u16).to_le_bytes());
        [&head, data].concat()
    };
    let laszip = record_of(laz::LazVlr::USER_ID, laz::LazVlr::RECORD_ID, &description);
    let mut out = [&plain[..header], &record_of("copc", 1, &[0; 160]), &plain[header..points], &laszip].concat();
    let start = out.len() as u32;
    out[96..100].copy_from_slice(&start.to_le_bytes());
    out[100..104].copy_from_slice(&(word(100) + 2).to_le_bytes());
    out[104] |= 0x80;
    let mut target = Cursor::new(out);
    target.set_position(u64::from(start));
    let mut coder = laz::LasZipCompressor::new(target, vlr).unwrap();
    coder.reserve_offset_to_chunk_table().unwrap();
    let mut at = points;
    let mut entries = Vec::new();
    for (level, count) in levels.iter().enumerate() {
        let chunk = coder.get().position();
        let end = at + *count as usize * record;
        coder.compress_many(&plain[at..end]).unwrap();
        if level + 1 < levels.len() {
            coder.finish_current_chunk().unwrap();
        }
        entries.push((level as i32, chunk, *count));
        at = end;
    }
    coder.done().unwrap();
    let mut out = coder.into_inner().into_inner();
    let entry = |(level, at, size, points): (i32, u64, i32, i32)| {
        let key = [level, 0, 0, 0].map(i32::to_le_bytes).concat();
        [key, at.to_le_bytes().to_vec(), [size, points].map(i32::to_le_bytes).concat()].concat()
    };
    let page = out.len() as u64;
    let last = entries.pop().unwrap();
    entries.iter().for_each(|(level, chunk, count)| out.extend(entry((*level, *chunk, 1, *count))));
    let length = 32 * (entries.len() as u64 + 1);
    out.extend(entry((last.0, page + length, 32, -1)));
    out.extend(entry((last.0, last.1, 1, last.2)));
    let info = header + 54 + 40;
    out[info..info + 8].copy_from_slice(&page.to_le_bytes());
    out[info + 8..info + 16].copy_from_slice(&length.to_le_bytes());
    out
}
