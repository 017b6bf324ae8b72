//! Programs of two variables, and with light.

use crate::gpu::second::{ARRAYS, defined};
use crate::gpu::shader::ShaderArray;
use crate::gpu::testing::validated;
use crate::integral::second::{Forms, Kind, Rows};
use crate::traverse::gpu::second::program;
use std::mem::offset_of;
use wgpu::naga;

/// A function of no numbers.
fn rows(forms: Forms) -> Rows {
    Rows { forms, panels: Default::default(), head: Default::default(), rows: vec![] }
}

fn arrays(forms: &Forms, chunks: usize) -> Vec<ShaderArray> {
    let all = super::super::ARRAYS[..5].iter().chain(&ARRAYS[..if forms.lit { 3 } else { 2 }]);
    all.map(|&(name, element)| ShaderArray { name, element, chunks, shift: 22 }).collect()
}

#[test]
fn every_program_of_two_variables_is_valid() {
    for bits in 0..64 {
        let [factor, logarithmic, direct, lit, pieces, whole] = [1, 2, 4, 8, 16, 32].map(|bit| bits & bit != 0);
        if whole && !lit {
            continue;
        }
        for source in [Kind::Scalar, Kind::Widgets, Kind::Texels] {
            let forms = Forms { source, factor, logarithmic, direct, lit, pieces, whole };
            for (association, chunks) in [("POINT", 1), ("CORNER", 3), ("CELL", 1)] {
                validated(&program(association, &rows(forms), &arrays(&forms, chunks)));
            }
            let closed = source == Kind::Widgets && bits & 15 == 0;
            assert_eq!(defined(&forms).contains(&"CLOSED"), closed);
        }
    }
}

#[test]
fn the_layout_of_functions_matches_its_rust_twin() {
    let (factor, lit, logarithmic, direct, pieces, whole) = (true, true, false, false, false, false);
    let forms = Forms { source: Kind::Scalar, factor, logarithmic, direct, lit, pieces, whole };
    let module = validated(&program("POINT", &rows(forms), &arrays(&forms, 1)));
    let (_, t) = module.types.iter().find(|(_, t)| t.name.as_deref() == Some("Second")).unwrap();
    let naga::TypeInner::Struct { members, span } = &t.inner else { panic!("it is a struct") };
    let found: Vec<usize> = members.iter().map(|m| m.offset as usize).collect();
    macro_rules! offsets {
        ($($field:ident)*) => { [$(offset_of!(crate::integral::second::Head, $field)),*] };
    }
    let wanted = offsets!(absorbing shining widgets knots factors texels lights lamps lines size scale offset ambient
        diffuse specular power silhouette cosine turn looks whole pieces);
    assert_eq!((*span as usize, &found[..]), (size_of::<crate::integral::second::Head>(), &wanted[..]));
}
