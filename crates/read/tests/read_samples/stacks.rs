//! Stacks of pages in TIFF, written byte by byte.

use std::io::Write;

/// Columns, rows and pages of the samples, whose numbers are 0, 1, 2 and so on.
pub(crate) const SIZE: [u32; 3] = [3, 2, 4];

/// How a stack is stored.
#[derive(Debug, Clone)]
pub(crate) struct Stack {
    pub(crate) big_endian: bool,
    /// Whether it is a BigTIFF.
    pub(crate) is_wide: bool,
    /// 1 for none, 5 LZW, 8 deflate, 32773 PackBits.
    pub(crate) packing: u16,
    /// Whether numbers are stored as differences.
    pub(crate) has_differences: bool,
    /// Side of a tile; strips of one row where it is 0.
    pub(crate) tile: u32,
    /// Bits of a number, and 1 for unsigned, 2 signed, 3 floats.
    pub(crate) bits: u16,
    pub(crate) format: u16,
    /// Numbers of a pixel, and what they mean: 0 white is 0, 1 black is 0, 2 colours, 3 of a list.
    pub(crate) numbers: u16,
    pub(crate) meaning: u16,
    pub(crate) size: [u32; 2],
    /// The numbers of each page.
    pub(crate) pages: Vec<Vec<f64>>,
    /// What the first page says.
    pub(crate) description: String,
    /// Pixels for each unit of length, over and under, and the unit: 1 none, 2 inch, 3 centimetre.
    pub(crate) resolution: Option<([u32; 2], u16)>,
}

impl Default for Stack {
    fn default() -> Self {
        let [width, height, depth] = SIZE;
        let page = |z: u32| (0..width * height).map(|i| f64::from(z * width * height + i)).collect();
        Self {
            big_endian: false,
            is_wide: false,
            packing: 1,
            has_differences: false,
            tile: 0,
            bits: 16,
            format: 1,
            numbers: 1,
            meaning: 1,
            size: [width, height],
            pages: (0..depth).map(page).collect(),
            description: String::new(),
            resolution: None,
        }
    }
}

/// A strip or a tile: its first column and row, and how many it has of them.
struct Part {
    x: u32,
    y: u32,
    across: u32,
    down: u32,
}

/// A tag with its type (2 text, 3 and 4 whole numbers of two and four bytes, 5 ratios) and its numbers.
type Tag = (u16, u16, Vec<u64>);

impl Stack {
    /// The bytes of the file.
    pub(crate) fn bytes(&self) -> Vec<u8> {
        let mut out = if self.big_endian { b"MM".to_vec() } else { b"II".to_vec() };
        self.put(&mut out, if self.is_wide { 43 } else { 42 }, 2);
        if self.is_wide {
            self.put(&mut out, 8, 2);
            self.put(&mut out, 0, 2);
        }
        let mut link = out.len();
        let word = if self.is_wide { 8 } else { 4 };
        self.put(&mut out, 0, word);
        for rank in 0..self.pages.len() {
            let tags = self.tags(rank, &mut out);
            let start = self.directory(&mut out, tags);
            let mut place = Vec::new();
            self.put(&mut place, start as u64, word);
            out[link..link + word].copy_from_slice(&place);
            link = out.len() - word;
        }
        out
    }

    fn put(&self, out: &mut Vec<u8>, number: u64, bytes: usize) {
        let little = &number.to_le_bytes()[..bytes];
        if self.big_endian { out.extend(little.iter().rev()) } else { out.extend(little) }
    }

    /// Writes the numbers of a page; gives its tags.
    fn tags(&self, rank: usize, out: &mut Vec<u8>) -> Vec<Tag> {
        let [width, height] = self.size;
        let [across, down] = if self.tile > 0 { [self.tile; 2] } else { [width, 1] };
        let mut starts = Vec::new();
        let mut lengths = Vec::new();
        for y in (0..height).step_by(down as usize) {
            for x in (0..width).step_by(across as usize) {
                let packed = self.packed(&self.chunk(rank, Part { x, y, across, down }));
                starts.push(out.len() as u64);
                lengths.push(packed.len() as u64);
                out.extend(packed);
            }
        }
        let one = |number: u16| vec![u64::from(number)];
        let each = |number: u16| vec![u64::from(number); usize::from(self.numbers)];
        let mut tags: Vec<Tag> = vec![
            (256, 4, vec![width.into()]),
            (257, 4, vec![height.into()]),
            (258, 3, each(self.bits)),
            (259, 3, one(self.packing)),
            (262, 3, one(self.meaning)),
        ];
        if rank == 0 && !self.description.is_empty() {
            tags.push((270, 2, self.description.bytes().chain([0]).map(u64::from).collect()));
        }
        let is_tiled = self.tile > 0;
        if !is_tiled {
            tags.push((273, 4, starts.clone()));
        }
        tags.push((277, 3, one(self.numbers)));
        if !is_tiled {
            tags.push((278, 3, vec![1]));
            tags.push((279, 4, lengths.clone()));
        }
        if let Some((ratio, unit)) = self.resolution {
            let ratio = vec![u64::from(ratio[0]), u64::from(ratio[1])];
            tags.extend([(282, 5, ratio.clone()), (283, 5, ratio), (296, 3, one(unit))]);
        }
        if self.has_differences {
            tags.push((317, 3, vec![2]));
        }
        if is_tiled {
            let side = u64::from(self.tile);
            tags.extend([(322, 3, vec![side]), (323, 3, vec![side]), (324, 4, starts), (325, 4, lengths)]);
        }
        tags.push((339, 3, each(self.format)));
        tags
    }

    /// The numbers of a strip or a tile, 0 beyond the page.
    fn chunk(&self, rank: usize, part: Part) -> Vec<u8> {
        let Part { x, y, across, down } = part;
        let mut chunk = Vec::new();
        let rows = if self.tile > 0 { y..y + down } else { y..(y + down).min(self.size[1]) };
        let numbers = usize::from(self.numbers);
        for row in rows {
            let mut before = vec![0; numbers];
            for column in x..x + across {
                for n in 0..numbers {
                    let at = (row as usize * self.size[0] as usize + column as usize) * numbers + n;
                    let is_inside = column < self.size[0] && row < self.size[1];
                    let value = if is_inside { self.pages[rank][at] } else { 0.0 };
                    let bits = match (self.format, self.bits) {
                        (3, 32) => u64::from((value as f32).to_bits()),
                        (3, _) => value.to_bits(),
                        _ => (value as i64).cast_unsigned(),
                    };
                    let stored = if self.has_differences { bits.wrapping_sub(before[n]) } else { bits };
                    before[n] = bits;
                    self.put(&mut chunk, stored, usize::from(self.bits / 8));
                }
            }
        }
        chunk
    }

    fn packed(&self, chunk: &[u8]) -> Vec<u8> {
        match self.packing {
            5 => weezl::encode::Encoder::with_tiff_size_switch(weezl::BitOrder::Msb, 8).encode(chunk).unwrap(),
            8 => {
                let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
                encoder.write_all(chunk).unwrap();
                encoder.finish().unwrap()
            }
            // Runs of other bytes, up to 128 each.
            32773 => chunk
                .chunks(128)
                .flat_map(|run| std::iter::once(run.len() as u8 - 1).chain(run.iter().copied()))
                .collect(),
            _ => chunk.to_vec(),
        }
    }

    /// Writes a directory, its longer values before it; gives where it begins.
    fn directory(&self, out: &mut Vec<u8>, tags: Vec<Tag>) -> usize {
        let word = if self.is_wide { 8 } else { 4 };
        let mut entries = Vec::new();
        for (tag, kind, numbers) in &tags {
            let size = match kind {
                2 => 1,
                3 => 2,
                _ => 4,
            };
            self.put(&mut entries, (*tag).into(), 2);
            self.put(&mut entries, (*kind).into(), 2);
            self.put(&mut entries, if *kind == 5 { 1 } else { numbers.len() as u64 }, word);
            let mut value = Vec::new();
            numbers.iter().for_each(|number| self.put(&mut value, *number, size));
            if value.len() > word {
                let start = out.len();
                out.append(&mut value);
                self.put(&mut value, start as u64, word);
            }
            value.resize(word, 0);
            entries.extend(value);
        }
        let start = out.len();
        self.put(out, tags.len() as u64, if self.is_wide { 8 } else { 2 });
        out.extend(entries);
        self.put(out, 0, word);
        start
    }
}
