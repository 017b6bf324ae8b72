//! Numbering, volumes and weights of the nodes of curved cells.

use super::super::linear::split;
use super::*;
use glam::DVec3;

/// Volume of the tetrahedra of a cell whose points are at `places`.
fn volume(shape: &Shape, places: &[[f64; 3]; 8]) -> f64 {
    let mut out = vec![[0; 4]; shape.tetrahedra];
    let ids: Vec<u32> = (0..shape.points as u32).collect();
    let place = |n: u32| DVec3::from(places[n as usize]);
    split(shape, &ids, place, &mut out);
    let volume = |[a, b, c, d]: [DVec3; 4]| (b - a).cross(c - a).dot(d - a).abs() / 6.0;
    out.iter().map(|t| volume(t.map(place))).sum()
}

/// The lattice points in the order of their numbers, as VTK 9.7 has them.
#[test]
fn numbered_as_by_vtk() {
    let expect = |text: &str, got: Vec<String>| assert_eq!(got, text.split_whitespace().collect::<Vec<_>>());
    let digits = |b: &[usize]| b.iter().map(usize::to_string).collect::<String>();
    let tetrahedron = "0008 8000 0800 0080 1007 2006 3005 4004 5003 6002 7001 7100 6200 5300 4400 3500 2600 1700 0701 0602 \
        0503 0404 0305 0206 0107 0017 0026 0035 0044 0053 0062 0071 7010 6020 5030 4040 3050 2060 1070 0710 \
        0620 0530 0440 0350 0260 0170 1016 6011 1061 2015 3014 4013 5012 5021 4031 3041 2051 1052 1043 1034 \
        1025 2024 4022 2042 3023 3032 2033 1610 1160 6110 1520 1430 1340 1250 2150 3140 4130 5120 5210 4310 \
        3410 2510 2420 2240 4220 2330 3230 3320 0116 0161 0611 0125 0134 0143 0152 0251 0341 0431 0521 0512 \
        0413 0314 0215 0224 0242 0422 0233 0332 0323 1106 1601 6101 1205 1304 1403 1502 2501 3401 4301 5201 \
        5102 4103 3104 2105 2204 2402 4202 2303 3302 3203 1115 5111 1511 1151 2114 3113 4112 4211 3311 2411 \
        1412 1313 1214 1124 1133 1142 4121 3131 2141 1421 1331 1241 2123 3122 2132 2321 2231 3221 1223 1232 \
        1322 2213 2312 3212 2222";
    expect(tetrahedron, tetrahedron_points(8).iter().map(|b| digits(b)).collect());
    let wedge = "000 500 050 003 503 053 100 200 300 400 410 320 230 140 040 030 020 010 103 203 303 403 413 323 233 \
        143 043 033 023 013 001 002 501 502 051 052 110 210 310 120 220 130 113 213 313 123 223 133 101 201 \
        301 401 102 202 302 402 411 321 231 141 412 322 232 142 041 031 021 011 042 032 022 012 111 211 311 \
        121 221 131 112 212 312 122 222 132";
    expect(wedge, groups(80, [5, 5, 3]).iter().map(|g| digits(&[g[0][0], g[0][1], g[1][0]])).collect());
    let hexahedron = "000 200 230 030 004 204 234 034 100 210 220 130 010 020 104 214 224 134 014 024 001 002 003 201 202 \
        203 231 232 233 031 032 033 011 021 012 022 013 023 211 221 212 222 213 223 101 102 103 131 132 133 \
        110 120 114 124 111 121 112 122 113 123";
    expect(hexahedron, groups(79, [2, 3, 4]).iter().map(|g| digits(&[g[0][0], g[1][0], g[2][0]])).collect());
}

/// Volume of the parts of a cell whose lattice points are where they belong, and sums of weights.
#[test]
fn lattices_fill_their_cells() {
    for p in 1..=MAX_DEGREE {
        for (vtk_type, points, share) in
            [(72, (p + 1).pow(3), 1.0), (73, (p + 1) * (p + 2) / 2 * (p + 1), 0.5), (71, simplex(p), 1.0 / 6.0)]
        {
            let recipe = Recipe::new(vtk_type, points, [0; 3]).expect("a cell of equal degrees");
            let places: Vec<[f64; 3]> = groups(vtk_type + 7, [p; 3])
                .iter()
                .map(|g| match vtk_type {
                    72 => [g[0][0], g[1][0], g[2][0]],
                    73 => [g[0][0], g[0][1], g[1][0]],
                    _ => [g[0][0], g[0][1], g[0][2]],
                })
                .map(|x| x.map(|x| x as f64 / p as f64))
                .collect();
            let volume: f64 =
                recipe.parts.iter().map(|(shape, ids)| volume(shape, &ids.map(|i| places[i as usize]))).sum();
            assert!((volume - share).abs() < 1e-12, "type {vtk_type}, degree {p}: {volume}");
        }
    }
}

#[test]
fn weights_add_up_to_one() {
    let cells = [(25, 20), (33, 24), (26, 15), (27, 13), (79, 64), (80, 40), (78, 35), (79, 8)];
    for (vtk_type, points) in cells {
        let recipe = Recipe::new(vtk_type, points, [0; 3]).expect("a cell");
        for node in &recipe.nodes {
            if let Node::Sum(weights) = node {
                let sum: f64 = weights.iter().map(|w| w.1).sum();
                assert!((sum - 1.0).abs() < 1e-14, "type {vtk_type}: {weights:?}");
            }
        }
    }
    assert_eq!(Recipe::new(79, 8, [0; 3]).map(|r| r.added), Ok(0));
    assert!(Recipe::new(72, 28, [0; 3]).is_err_and(|e| e.contains("28 points")));
    assert_eq!(Recipe::new(72, 3 * 4 * 2, [2, 3, 1]).map(|r| r.parts.len()), Ok(6));
}
