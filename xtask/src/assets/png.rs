//! Grey pictures as PNG without compression: a format that needs no library (RFC 2083, RFC 1950, RFC 1951).

/// The bytes of a picture of `width` pixels in a row, from the top left.
pub(super) fn grey(width: usize, pixels: &[u8]) -> Vec<u8> {
    let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
    let size = [width, pixels.len() / width].map(|n| (n as u32).to_be_bytes());
    // Eight bits of grey, no interlacing.
    chunk(&mut file, b"IHDR", &[size.as_flattened(), &[8, 0, 0, 0, 0]].concat());
    // Each row begins with its filter, none.
    let rows: Vec<u8> = pixels.chunks(width).flat_map(|row| std::iter::once(0).chain(row.iter().copied())).collect();
    chunk(&mut file, b"IDAT", &stored(&rows));
    chunk(&mut file, b"IEND", &[]);
    file
}

fn chunk(file: &mut Vec<u8>, name: &[u8; 4], data: &[u8]) {
    file.extend((data.len() as u32).to_be_bytes());
    let begin = file.len();
    file.extend(name);
    file.extend(data);
    let crc = !file[begin..].iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 })
    });
    file.extend(crc.to_be_bytes());
}

/// A stream of blocks that are stored as they are.
fn stored(data: &[u8]) -> Vec<u8> {
    /// Most bytes of a block.
    const MOST: usize = 65_535;
    let mut stream = vec![0x78, 0x01];
    let blocks = data.len().div_ceil(MOST);
    for (i, block) in data.chunks(MOST).enumerate() {
        let length = block.len() as u16;
        stream.push(u8::from(i + 1 == blocks));
        stream.extend(length.to_le_bytes());
        stream.extend((!length).to_le_bytes());
        stream.extend(block);
    }
    let sums = data.iter().fold([1u32, 0], |[a, b], byte| {
        let a = (a + u32::from(*byte)) % 65_521;
        [a, (a + b) % 65_521]
    });
    stream.extend((sums[1] << 16 | sums[0]).to_be_bytes());
    stream
}
