//! A small file of ASTM E57: two scans.

/// Bytes of a page, and of its sum.
const PAGE: usize = 1024;
const SUM: usize = 4;

/// The file with the right sums at the ends of its pages, the last of which is filled up, and its right length.
pub(crate) fn summed(mut content: Vec<u8>) -> Vec<u8> {
    content.resize(content.len().next_multiple_of(PAGE).max(PAGE), 0);
    let length = content.len() as u64;
    content[16..24].copy_from_slice(&length.to_le_bytes());
    content.chunks_mut(PAGE).for_each(sum);
    content
}

/// Puts the sum of a page at its end: CRC-32C.
pub(crate) fn sum(page: &mut [u8]) {
    let (bytes, end) = page.split_at_mut(PAGE - SUM);
    let sum = !bytes.iter().fold(!0u32, |sum, byte| {
        (0..8).fold(sum ^ u32::from(*byte), |s, _| if s & 1 == 1 { s >> 1 ^ 0x82f6_3b78 } else { s >> 1 })
    });
    end.copy_from_slice(&sum.to_be_bytes());
}

/// Whole numbers in so many bits each.
fn packed(numbers: &[u64], bits: u32) -> Vec<u8> {
    let joined = numbers.iter().rev().fold(0u128, |joined, n| joined << bits | u128::from(*n));
    joined.to_le_bytes()[..(numbers.len() * bits as usize).div_ceil(8)].to_vec()
}

fn doubles(numbers: &[f64]) -> Vec<u8> {
    numbers.iter().flat_map(|n| n.to_le_bytes()).collect()
}

/// A packet of data: a piece of each field.
fn packet(pieces: &[Vec<u8>]) -> Vec<u8> {
    let mut out = vec![1, 0, 0, 0];
    out.extend((pieces.len() as u16).to_le_bytes());
    pieces.iter().for_each(|piece| out.extend((piece.len() as u16).to_le_bytes()));
    pieces.iter().for_each(|piece| out.extend(piece));
    out.resize(out.len().next_multiple_of(4), 0);
    let length = out.len() as u16 - 1;
    out[2..4].copy_from_slice(&length.to_le_bytes());
    out
}

/// The first scan has four points, the third of which has no place, in two packets with another kind between them:
/// (i/2, i + 1, -2 i) before a quarter turn about z and a move by (10, 20, 30); red 255, green 51 i; intensity 1000 i; row 7. The second
/// has two spherical points, two along y and three along −z, and no colour.
pub(crate) fn e57() -> Vec<u8> {
    let x: Vec<u8> = (0..4).flat_map(|i| (0.5 * i as f32).to_le_bytes()).collect();
    let columns = [
        x,
        packed(&[0, 100, 200, 300], 10),
        doubles(&[0.0, -2.0, -4.0, -6.0]),
        packed(&[255; 4], 8),
        packed(&[0, 51, 102, 153], 8),
        packed(&[0; 4], 8),
        packed(&[0, 1000, 2000, 3000], 12),
        packed(&[0, 0, 2, 0], 2),
        Vec::new(),
    ];
    let halves = [0, 1].map(|half| {
        let piece =
            |column: &Vec<u8>| column[[0, column.len() / 2][half]..[column.len() / 2, column.len()][half]].to_vec();
        packet(&columns.iter().map(piece).collect::<Vec<_>>())
    });
    let quarter = std::f64::consts::FRAC_PI_2;
    let first = [&halves[0][..], &[2, 0, 3, 0], &halves[1]].concat();
    let second = packet(&[doubles(&[2.0, 3.0]), doubles(&[quarter, 0.0]), doubles(&[0.0, -quarter])]);
    let physical = |at: usize| at + at / (PAGE - SUM) * SUM;
    let mut bytes = vec![0; 48];
    let mut sections = Vec::new();
    for packets in [first, second] {
        sections.push(physical(bytes.len()));
        let data = physical(bytes.len() + 32);
        bytes.extend([1u64, 32 + packets.len() as u64, data as u64, 0].iter().flat_map(|n| n.to_le_bytes()));
        bytes.extend(packets);
    }
    let description = description(&sections);
    let header = [1, 0, physical(bytes.len()) as u64, description.len() as u64, PAGE as u64];
    bytes[..8].copy_from_slice(b"ASTM-E57");
    header.iter().enumerate().for_each(|(i, n)| bytes[8 + 8 * i..16 + 8 * i].copy_from_slice(&n.to_le_bytes()));
    bytes.extend(description.as_bytes());
    let pages = bytes.chunks(PAGE - SUM).flat_map(|page| {
        let mut page = page.to_vec();
        page.resize(PAGE, 0);
        page
    });
    summed(pages.collect())
}

fn description(sections: &[usize]) -> String {
    let integer = |name: &str, most: u32| format!("<{name} type=\"Integer\" minimum=\"0\" maximum=\"{most}\"/>");
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let colors = ["Red", "Green", "Blue"].map(|color| integer(&format!("color{color}"), 255)).concat();
    let limits = ["Red", "Green", "Blue"].map(|color| {
        format!(
            "<color{color}Minimum type=\"Integer\"/><color{color}Maximum type=\"Integer\">255</color{color}Maximum>"
        )
    });
    let angles = ["Range", "Azimuth", "Elevation"].map(|name| format!("<spherical{name} type=\"Float\"/>")).concat();
    let numbers = |names: [&str; 3]| {
        let values = [10, 20, 30].iter().zip(names);
        values.map(|(v, name)| format!("<{name} type=\"Float\">{v}</{name}>")).collect::<String>()
    };
    format!(
        "<?xml version=\"1.0\"?><e57Root type=\"Structure\" xmlns=\"http://www.astm.org/COMMIT/E57/2010-e57-v1.0\">\
         <data3D type=\"Vector\"><vectorChild type=\"Structure\"><pose type=\"Structure\"><rotation type=\"Structure\">\
         <w type=\"Float\">{half}</w><x type=\"Float\"/><y type=\"Float\"/><z type=\"Float\">{half}</z></rotation>\
         <translation type=\"Structure\">{}</translation></pose><colorLimits type=\"Structure\">{}</colorLimits>\
         <points type=\"CompressedVector\" fileOffset=\"{}\" recordCount=\"4\"><prototype type=\"Structure\">\
         <cartesianX type=\"Float\" precision=\"single\"/>\
         <cartesianY type=\"ScaledInteger\" minimum=\"0\" maximum=\"1000\" scale=\"0.01\" offset=\"1\"/><cartesianZ type=\"Float\"/>\
         {colors}{}{}<rowIndex type=\"Integer\" minimum=\"7\" maximum=\"7\"/></prototype></points></vectorChild>\
         <vectorChild type=\"Structure\"><points type=\"CompressedVector\" fileOffset=\"{}\" recordCount=\"2\">\
         <prototype type=\"Structure\">{angles}</prototype></points></vectorChild></data3D>\
         <images2D type=\"Vector\"><vectorChild type=\"Structure\"/></images2D></e57Root>",
        numbers(["x", "y", "z"]),
        limits.concat(),
        sections[0],
        integer("intensity", 4095),
        integer("cartesianInvalidState", 2),
        sections[1],
    )
}
