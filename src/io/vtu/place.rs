//! Kinds of grids, and where pieces of them are that say it by numbers of points along each axis.

use super::head::{Head, Piece};
use crate::error::Result;
use crate::io::blocks::Block;
use glam::{DMat3, DVec3};
use quick_xml::events::BytesStart;
use std::str::FromStr;

/// The kinds of grids that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Kind {
    #[default]
    Unstructured,
    Image,
    Rectilinear,
    Structured,
}

impl Kind {
    /// The kind that a file of that type holds, and whether it lists the pieces.
    pub(super) fn from_type(name: &str) -> Option<(Kind, bool)> {
        let all = [Kind::Unstructured, Kind::Image, Kind::Rectilinear, Kind::Structured];
        let find = |name: &str| all.into_iter().find(|kind| kind.name() == name);
        let list = || name.strip_prefix('P').and_then(find).map(|kind| (kind, true));
        find(name).map(|kind| (kind, false)).or_else(list)
    }

    /// Its element in a file.
    pub(super) fn name(self) -> &'static str {
        match self {
            Kind::Unstructured => "UnstructuredGrid",
            Kind::Image => "ImageData",
            Kind::Rectilinear => "RectilinearGrid",
            Kind::Structured => "StructuredGrid",
        }
    }
}

impl Head {
    /// A piece as its tag describes it.
    pub(super) fn piece(&self, tag: &BytesStart<'_>) -> Result<Piece> {
        let mut piece = Piece { old_numbering: self.old_numbering, ..Piece::default() };
        if self.kind == Kind::Unstructured {
            (piece.points, piece.cells) = (self.count(tag, "NumberOfPoints")?, self.count(tag, "NumberOfCells")?);
            return Ok(piece);
        }
        let block = self.block(tag, "Extent")?.or(self.whole);
        let block = block.ok_or_else(|| self.malformed("a <Piece> has no Extent"))?;
        let counts = block.points().zip(block.cells());
        (piece.points, piece.cells) = counts.ok_or_else(|| self.malformed("a <Piece> has more points than can be"))?;
        piece.block = Some(block);
        Ok(piece)
    }

    /// Takes in where the whole of a grid is.
    pub(super) fn add_whole(&mut self, tag: &BytesStart<'_>) -> Result<()> {
        if self.kind == Kind::Unstructured {
            return Ok(());
        }
        self.whole = self.block(tag, "WholeExtent")?;
        let place = |name: &str, to: &mut [f64]| -> Result<()> {
            if let Some(numbers) = self.numbers::<f64>(tag, name, to.len())? {
                to.copy_from_slice(&numbers);
            }
            Ok(())
        };
        let (mut origin, mut spacing) = ([0.0; 3], [1.0; 3]);
        let mut direction = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
        place("Origin", &mut origin)?;
        place("Spacing", &mut spacing)?;
        place("Direction", &mut direction)?;
        self.lattice.origin = DVec3::from_array(origin);
        self.lattice.spacing = DVec3::from_array(spacing);
        // The file has it row by row.
        self.lattice.direction = DMat3::from_cols_array(&direction).transpose();
        Ok(())
    }

    /// The extent that an attribute says.
    fn block(&self, tag: &BytesStart<'_>, name: &str) -> Result<Option<Block>> {
        let numbers = self.numbers::<i32>(tag, name, 6)?;
        Ok(numbers.map(|n| Block::new([0, 2, 4].map(|i| [n[i].into(), n[i + 1].into()]))))
    }

    /// As many numbers as an attribute must hold; none if there is no such attribute.
    fn numbers<T: FromStr>(&self, tag: &BytesStart<'_>, name: &str, count: usize) -> Result<Option<Vec<T>>> {
        let Some(text) = self.attribute(tag, name)? else { return Ok(None) };
        let numbers: Option<Vec<T>> = text.split_ascii_whitespace().map(|word| word.parse().ok()).collect();
        let numbers = numbers.filter(|numbers| numbers.len() == count);
        let what = || self.malformed(format!("{name} is \"{}\", not {count} numbers", text.escape_debug()));
        numbers.ok_or_else(what).map(Some)
    }
}
