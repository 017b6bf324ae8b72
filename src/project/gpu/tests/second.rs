//! Programs of two variables, and with light.

use super::*;
use crate::gpu::second::ARRAYS;
use crate::integral::second::{Forms, Kind as Source, Rows};
use crate::project::gpu::program::program_of_two;

#[test]
fn every_program_of_two_variables_is_valid() {
    for bits in 0..32 {
        let [factor, logarithmic, direct, lit, pieces] = [1, 2, 4, 8, 16].map(|bit| bits & bit != 0);
        let whole = lit && pieces;
        for source in [Source::Scalar, Source::Widgets, Source::Texels] {
            let forms = Forms { source, factor, logarithmic, direct, lit, pieces, whole };
            let rows = Rows { forms, panels: Default::default(), head: Default::default(), rows: vec![] };
            for fragments in FORMS.into_iter().filter(|&f| !lit || f == Fragments::Intersected) {
                let association = ["POINT", "CORNER"][bits & 1];
                let options = ProjectionOptions { fragments, ..ProjectionOptions::default() };
                let names = super::super::ARRAYS[..2].iter().chain(&ARRAYS[..if lit { 3 } else { 2 }]);
                let chunks = 1 + (bits & 1);
                let arrays: Vec<_> =
                    names.map(|&(name, element)| ShaderArray { name, element, chunks, shift: 22 }).collect();
                let layout = Layout::of_two(fragments, fragments == Fragments::Intersected, lit);
                let limits = Limits { ends: direct, planes: factor, perspective: !direct, ..Limits::default() };
                let drawn = DrawSettings { options: &options, blend: Blend::Composite };
                let module = validated(&program_of_two(&rows, association, drawn, &layout, limits, &arrays));
                let (_, vertex) = module.types.iter().find(|(_, t)| t.name.as_deref() == Some("Vertex")).unwrap();
                let naga::TypeInner::Struct { span, .. } = &vertex.inner else { panic!("it is a struct") };
                assert_eq!(u64::from(*span), layout.part_bytes());
                // What devices surely take from one vertex, and hand on to fragments.
                assert!(layout.vertex_attributes().iter().map(Vec::len).sum::<usize>() <= 16);
            }
        }
    }
}
