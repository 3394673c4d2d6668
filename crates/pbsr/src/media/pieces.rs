//! A transfer function in pieces between its points; quotients are computed once.

use splat_core::{TransferFunction, TransferPoint};

/// Values between two points of a transfer function, or beyond its last one.
#[derive(Debug, Clone, Copy)]
struct Piece {
    from: TransferPoint,
    /// Change over a unit of the value.
    color: [f32; 3],
    extinction: f32,
}

/// No piece: the values of a cell lie in more than one.
pub(crate) const SEVERAL: u32 = u32::MAX;

/// The pieces, in order.
#[derive(Debug, Clone)]
pub(crate) struct Pieces {
    pieces: Vec<Piece>,
}

impl Pieces {
    pub(crate) fn new(transfer: &TransferFunction) -> Self {
        let points = transfer.points();
        let piece = |k: usize| {
            let from = points[k];
            let Some(to) = points.get(k + 1) else { return Piece { from, color: [0.0; 3], extinction: 0.0 } };
            let inverse = 1.0 / (to.value - from.value);
            let color = std::array::from_fn(|c| (to.color[c] - from.color[c]) * inverse);
            Piece { from, color, extinction: (to.extinction - from.extinction) * inverse }
        };
        Self { pieces: (0..points.len()).map(piece).collect() }
    }

    /// Number of pieces.
    #[cfg(feature = "gpu")]
    pub(crate) fn len(&self) -> usize {
        self.pieces.len()
    }

    /// Value, colour, extinction and their changes of each piece, as kernels read them.
    #[cfg(feature = "gpu")]
    pub(crate) fn words(&self) -> Vec<u32> {
        let words = |p: &Piece| {
            let [r, g, b] = p.from.color;
            let [dr, dg, db] = p.color;
            [p.from.value, r, g, b, p.from.extinction, dr, dg, db, p.extinction].map(f32::to_bits)
        };
        self.pieces.iter().flat_map(words).collect()
    }

    /// The piece in which all values `low ..= high` lie, if there is one that spares a search.
    pub(crate) fn containing(&self, low: f32, high: f32) -> u32 {
        let after = self.pieces.partition_point(|p| p.from.value <= low);
        let ends = self.pieces.get(after).is_none_or(|next| high <= next.from.value);
        if after > 0 && ends { (after - 1) as u32 } else { SEVERAL }
    }

    /// Colour and extinction at a value of a piece.
    #[inline(always)]
    pub(crate) fn at(&self, piece: u32, value: f32) -> TransferPoint {
        let Piece { from, color, extinction } = &self.pieces[piece as usize];
        let t = value - from.value;
        TransferPoint {
            value,
            color: std::array::from_fn(|c| from.color[c] + color[c] * t),
            extinction: from.extinction + extinction * t,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_have_the_values_of_the_function() {
        let point = |value, extinction| TransferPoint { value, color: [value + 1.0, 1.5 - value, 0.5], extinction };
        let transfer = TransferFunction::new(vec![point(-1.0, 0.5), point(0.25, 2.0), point(1.0, 0.0)]);
        let transfer = transfer.unwrap_or_else(|e| panic!("{e}"));
        let pieces = Pieces::new(&transfer);
        assert_eq!(
            [pieces.containing(-2.0, 0.0), pieces.containing(0.0, 0.5), pieces.containing(-2.0, -1.5)],
            [SEVERAL; 3]
        );
        for (low, high, piece) in [(-1.0, 0.25, 0), (0.25, 1.0, 1), (0.3, 0.4, 1), (1.0, 9.0, 2), (2.0, 3.0, 2)] {
            assert_eq!(pieces.containing(low, high), piece);
            for k in 0..=10 {
                let value = low + (high - low) * k as f32 / 10.0;
                let found = pieces.at(piece, value);
                let expected = transfer.at(value);
                assert!((found.extinction - expected.extinction).abs() < 1e-6, "{value}: {found:?} {expected:?}");
                assert!((0..3).all(|c| (found.color[c] - expected.color[c]).abs() < 1e-6));
            }
        }
    }
}
