//! An ensemble as bytes and back, exactly: a resumed render ends in the same bits as one that never stopped.
//!
//! Layout, little endian: `PBSR`, version, tag (32 bytes, the caller's: a hash of scene and parameters), width, height,
//! flags, radiance unit, depth range, levels, hits, sums, squares, depths, objects, sums by channel if extinction differs by
//! channel, CRC-32 of all bytes before it.

use crate::ensemble::depths::DepthSum;
use crate::ensemble::{Apart, Ensemble, EnsembleParams, NearestObject};
use crate::error::Error;

const MAGIC: [u8; 4] = *b"PBSR";
const VERSION: u32 = 4;
const HEADER: usize = 4 + 4 + 32 + 8 + 4 + 4 + 8 + 4;

impl Ensemble {
    /// Serializes all sums, with a tag that [`Ensemble::from_bytes`] compares.
    pub fn to_bytes(&self, tag: &[u8; 32]) -> Vec<u8> {
        let mut out = Vec::with_capacity(HEADER + self.bytes() as usize + 4);
        out.extend_from_slice(&MAGIC);
        out.extend_from_slice(&VERSION.to_le_bytes());
        out.extend_from_slice(tag);
        self.size().iter().for_each(|s| out.extend_from_slice(&s.to_le_bytes()));
        let p = &self.params;
        let bits = [p.effects, p.normal, p.shadow, p.depth_range.is_some(), p.object, p.colored_extinction];
        let flags = bits.iter().enumerate().fold(0u32, |f, (i, on)| f | u32::from(*on) << i);
        out.extend_from_slice(&flags.to_le_bytes());
        out.extend_from_slice(&p.radiance_unit.to_le_bytes());
        p.depth_range.unwrap_or_default().iter().for_each(|d| out.extend_from_slice(&d.to_le_bytes()));
        out.extend_from_slice(&self.levels().to_le_bytes());
        self.hits.iter().for_each(|v| out.extend_from_slice(&v.to_le_bytes()));
        self.sums.iter().for_each(|v| out.extend_from_slice(&v.to_le_bytes()));
        self.squares.iter().for_each(|v| out.extend_from_slice(&v.to_le_bytes()));
        let mut put = |word: u32| out.extend_from_slice(&word.to_le_bytes());
        self.depths.iter().flat_map(DepthSum::words).for_each(&mut put);
        self.objects.iter().flat_map(|o| [o.depth.to_bits(), o.object]).for_each(&mut put);
        for apart in &self.apart {
            apart.beside.iter().flat_map(|v| [*v as u32, (*v as u64 >> 32) as u32]).for_each(&mut put);
            apart.either.iter().copied().for_each(&mut put);
        }
        let crc = crc32(&out);
        out.extend_from_slice(&crc.to_le_bytes());
        out
    }

    /// The ensemble that [`Ensemble::to_bytes`] wrote.
    ///
    /// # Errors
    /// [`Error::Checkpoint`] for bytes that are damaged, cut, of another version, or of another tag.
    pub fn from_bytes(bytes: &[u8], tag: &[u8; 32]) -> Result<Self, Error> {
        let bad = |why: &str| Error::Checkpoint(why.to_owned());
        let (body, crc) = bytes.split_last_chunk::<4>().ok_or_else(|| bad("cut short"))?;
        if body.len() < HEADER || body[..4] != MAGIC {
            return Err(bad("not a checkpoint of particles"));
        }
        let mut read = Reader(&body[4..]);
        if read.u32()? != VERSION {
            return Err(bad("written by another version"));
        }
        if crc32(body) != u32::from_le_bytes(*crc) {
            return Err(bad("damaged: its checksum differs"));
        }
        if read.take::<32>()? != *tag {
            return Err(bad("of another scene or other parameters"));
        }
        let size = [read.u32()?, read.u32()?];
        let flags = read.u32()?;
        let radiance_unit = f32::from_bits(read.u32()?);
        let range = [f32::from_bits(read.u32()?), f32::from_bits(read.u32()?)];
        let on = |bit: u32| flags >> bit & 1 == 1;
        let depth_range = on(3).then_some(range);
        let effects = on(0);
        let normal = on(1);
        let shadow = on(2);
        let object = on(4);
        let colored_extinction = on(5);
        let params = EnsembleParams { effects, normal, shadow, depth_range, object, colored_extinction, radiance_unit };
        let levels = read.u32()?;
        params.validate().map_err(|e| bad(&e.to_string()))?;
        // The length is checked before anything of that length is made.
        let pixels = size.iter().map(|s| u64::from(s.div_ceil(64)) * 64).product::<u64>();
        if pixels.checked_mul(bytes_of_pixel(&params)) != Some(read.0.len() as u64) {
            return Err(bad("its length does not fit its image"));
        }
        let mut ensemble = Self::new(size, &params).map_err(|e| bad(&e.to_string()))?;
        ensemble.levels = levels;
        for v in &mut ensemble.hits {
            *v = read.u32()?;
        }
        if ensemble.hits.iter().any(|hits| *hits > levels) {
            return Err(bad("damaged: a pixel has more hits than there are sets"));
        }
        for v in &mut ensemble.sums {
            *v = i64::from_le_bytes(read.take()?);
        }
        for v in &mut ensemble.squares {
            *v = u64::from_le_bytes(read.take()?);
        }
        for depth in &mut ensemble.depths {
            *depth = DepthSum::from_words(&read.words()?);
        }
        for nearest in &mut ensemble.objects {
            *nearest = NearestObject { depth: f32::from_bits(read.u32()?), object: read.u32()? };
        }
        for apart in &mut ensemble.apart {
            let beside = [read.take()?, read.take()?, read.take()?].map(i64::from_le_bytes);
            *apart = Apart { beside, either: read.words()? };
        }
        Ok(ensemble)
    }
}

/// Bytes of a pixel in the file, where nothing is padded.
fn bytes_of_pixel(params: &EnsembleParams) -> u64 {
    let planes = |on: bool, words: usize| if on { 4 * words } else { 0 };
    let bytes = 4 * params.hit_channels()
        + 8 * (params.channels() + 1)
        + planes(params.depth_range.is_some(), DepthSum::WORDS)
        + planes(params.object, 2)
        + planes(params.colored_extinction, 9);
    bytes as u64
}

struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], Error> {
        let (head, rest) = self.0.split_first_chunk::<N>().ok_or_else(|| Error::Checkpoint("cut short".to_owned()))?;
        self.0 = rest;
        Ok(*head)
    }

    fn u32(&mut self) -> Result<u32, Error> {
        Ok(u32::from_le_bytes(self.take()?))
    }

    fn words<const N: usize>(&mut self) -> Result<[u32; N], Error> {
        let mut words = [0; N];
        for word in &mut words {
            *word = self.u32()?;
        }
        Ok(words)
    }
}

/// CRC-32 (IEEE 802.3), eight bytes a turn by eight tables.
fn crc32(bytes: &[u8]) -> u32 {
    const TABLES: [[u32; 256]; 8] = tables();
    let mut crc = !0u32;
    let mut eights = bytes.chunks_exact(8);
    for b in &mut eights {
        let low = crc ^ u32::from_le_bytes([b[0], b[1], b[2], b[3]]);
        crc = (0..4).fold(0, |c, k| c ^ TABLES[7 - k][(low >> (8 * k) & 255) as usize]);
        crc = (0..4).fold(crc, |c, k| c ^ TABLES[3 - k][usize::from(b[4 + k])]);
    }
    for b in eights.remainder() {
        crc = crc >> 8 ^ TABLES[0][((crc ^ u32::from(*b)) & 255) as usize];
    }
    !crc
}

const fn tables() -> [[u32; 256]; 8] {
    let mut t = [[0u32; 256]; 8];
    let mut i = 0;
    while i < 256 {
        let mut c = i as u32;
        let mut bit = 0;
        while bit < 8 {
            c = if c & 1 == 1 { c >> 1 ^ 0xedb8_8320 } else { c >> 1 };
            bit += 1;
        }
        t[0][i] = c;
        i += 1;
    }
    let mut k = 1;
    while k < 8 {
        let mut i = 0;
        while i < 256 {
            t[k][i] = t[k - 1][i] >> 8 ^ t[0][(t[k - 1][i] & 255) as usize];
            i += 1;
        }
        k += 1;
    }
    t
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checksum_is_the_usual_one() {
        assert_eq!(crc32(b"123456789"), 0xcbf4_3926);
        assert_eq!(crc32(b"The quick brown fox jumps over the lazy dog"), 0x414f_a339);
        assert_eq!(crc32(b""), 0);
    }

    #[test]
    fn damaged_and_foreign_checkpoints_are_refused() {
        let params = EnsembleParams {
            depth_range: Some([1.0, 2.0]),
            normal: true,
            object: true,
            colored_extinction: true,
            ..EnsembleParams::default()
        };
        let ensemble = Ensemble::new([3, 5], &params).unwrap();
        let bytes = ensemble.to_bytes(&[7; 32]);
        assert_eq!(Ensemble::from_bytes(&bytes, &[7; 32]).unwrap(), ensemble);
        assert!(Ensemble::from_bytes(&bytes, &[8; 32]).is_err());
        for cut in [0, 3, 40, bytes.len() - 1] {
            assert!(Ensemble::from_bytes(&bytes[..cut], &[7; 32]).is_err());
        }
        for at in (0..bytes.len()).step_by(997).chain([4, 40, 44, 48, 60]) {
            let mut broken = bytes.clone();
            broken[at] ^= 16;
            assert!(Ensemble::from_bytes(&broken, &[7; 32]).is_err(), "byte {at}");
        }
        let mut hit = Ensemble::new([3, 5], &params).unwrap();
        (hit.levels, hit.hits[4]) = (1, 1);
        assert_eq!(Ensemble::from_bytes(&hit.to_bytes(&[7; 32]), &[7; 32]).unwrap(), hit);
        hit.hits[4] = 2;
        let error = Ensemble::from_bytes(&hit.to_bytes(&[7; 32]), &[7; 32]).unwrap_err();
        assert!(error.to_string().contains("more hits than there are sets"), "{error}");
    }
}
