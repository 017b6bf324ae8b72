use super::*;
use crate::field::{Association, Component};
use crate::integral::Form;
use crate::integral::options::Texels;
use crate::integral::table::Kind;
use crate::mesh::generate;
use crate::view::{Camera, Projection};

fn view(size: u32) -> View {
    let projection = Projection::Perspective { view_angle: 40.0 };
    let (position, focal_point) = (DVec3::new(4.0, 3.0, 5.0), DVec3::new(0.5, 0.5, 0.5));
    View::new(Camera { position, focal_point, view_up: DVec3::Y, projection }, [size; 2]).unwrap()
}

fn mesh() -> Mesh {
    generate::hexahedra(3)
}

fn session() -> Session {
    let mut session = Session::new(2, "cpu", "auto", Log::default()).unwrap();
    let opacity = vec![(0.0, 0.0), (0.4, 1.0), (0.6, 0.0), (1.0, 0.7)];
    session.set_transfer(
        &TransferFunction::new(vec![(0.0, [1.0, 0.5, 0.0]), (1.0, [0.0, 0.5, 1.0])], opacity, 0.3).unwrap(),
    );
    session
}

fn set(session: &mut Session, mesh: &Mesh, matrix: DMat4) {
    session.set_mesh(mesh, matrix).unwrap();
    set_field(session, mesh);
}

fn set_field(session: &mut Session, mesh: &Mesh) {
    let values: Vec<f64> = mesh.points().iter().map(|p| p.x * 0.7 + p.y * p.z * 0.3).collect();
    session.set_field(|| Field::from_slice("s", &values, 1, Association::Point, Component::Index(0))).unwrap();
}

fn draw(session: &mut Session) -> Image {
    session.render(&view(40), &mut |_| Ok(true)).unwrap()
}

#[test]
fn a_matrix_draws_what_moved_points_draw() {
    let mut shear = DMat4::from_scale(DVec3::new(2.0, 0.3, 1.5));
    shear.y_axis.x = 0.8;
    let mirror = DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0)) * DMat4::from_translation(DVec3::new(-1.0, 0.2, 0.0));
    let far = DMat4::from_scale(DVec3::splat(3.0)) * DMat4::from_rotation_z(2.0);
    let tets = mesh();
    let split = Tetrahedra::new(&tets).unwrap();
    let mut moving = session();
    set(&mut moving, &tets, DMat4::IDENTITY);
    for matrix in [shear, mirror, far, DMat4::IDENTITY] {
        // The same tetrahedra at the moved places, by way of a mesh of their own.
        let types = vec![10; split.corners.len()];
        let offsets = (0..=types.len() as u64).map(|i| 4 * i).collect();
        let connectivity = split.corners.as_flattened().to_vec();
        let cells = crate::mesh::Cells { types, offsets, connectivity };
        let moved = Mesh::new(transformed(tets.points(), matrix).unwrap(), cells, vec![], vec![]).unwrap();
        let mut plain = session();
        plain.set_mesh(&moved, DMat4::IDENTITY).unwrap();
        set_field(&mut plain, &tets);
        let expected = draw(&mut plain);
        assert!(expected.pixels.iter().any(|p| p[3] > 0.1), "{matrix}");

        let mut fresh = session();
        set(&mut fresh, &tets, matrix);
        assert!(draw(&mut fresh).compare(&expected).unwrap().max < 2e-5, "{matrix}");

        let kept = moving.set_points(tets.points(), matrix).unwrap();
        assert_eq!(kept, matrix.determinant() > 0.0);
        if kept {
            assert!(draw(&mut moving).compare(&expected).unwrap().max < 2e-5, "{matrix}");
        }
    }
}

#[test]
fn progress_is_told_here_and_may_end_a_frame() {
    let mut session = session();
    set(&mut session, &generate::hexahedra(20), DMat4::IDENTITY);
    let here = std::thread::current().id();
    let mut told = vec![];
    let slow = view(900);
    session
        .render(&slow, &mut |share| {
            assert_eq!(std::thread::current().id(), here);
            told.push(share);
            Ok(true)
        })
        .unwrap();
    assert!(told.windows(2).all(|w| w[0] <= w[1]) && told.iter().all(|s| (0.0..=1.0).contains(s)), "{told:?}");
    assert!(!told.is_empty(), "a frame of 900 x 900 pixels takes more than 20 ms");
    assert!(matches!(session.render(&slow, &mut |_| Ok(false)), Err(Error::Aborted)));
    let trouble = session.render(&slow, &mut |_| Err(Error::Render("trouble".into()))).unwrap_err();
    assert!(trouble.to_string().contains("trouble"));
    draw(&mut session);
}

#[test]
fn a_panic_is_an_error_and_ends_the_session() {
    let mut session = session();
    let said = session.guarded(|_| -> Result<()> { panic!("oh\nno") }).unwrap_err().to_string();
    assert!(said.contains("oh no"), "{said}");
    assert!(session.guarded(|_| Ok(())).unwrap_err().to_string().contains("make another"));
}

#[test]
fn an_error_does_not_end_the_session() {
    let mut session = session();
    assert!(session.guarded(|s| s.set_mesh(&mesh(), DMat4::ZERO)).is_err());
    session.guarded(|_| Ok(())).unwrap();
}

#[test]
fn a_mesh_with_nothing_to_draw_gives_empty_pictures() {
    let mut session = session();
    session
        .set_mesh(
            &Mesh::new(vec![], crate::mesh::Cells { offsets: vec![0], ..Default::default() }, vec![], vec![]).unwrap(),
            DMat4::IDENTITY,
        )
        .unwrap();
    session.set_field(|| Err(Error::Render("not asked".into()))).unwrap();
    assert!(draw(&mut session).pixels.iter().all(|p| *p == [0.0; 4]));
}

#[test]
fn unknown_names_are_refused_with_those_that_exist() {
    let message = Session::new(1, "cpu", "magic", Log::default()).unwrap_err().to_string();
    assert!(message.contains("magic") && message.contains("traverse") && message.contains("project"), "{message}");
    assert!(Session::new(1, "cpu", "project", Log::default()).is_ok());
    let message = named::<Form>("integral", "guess").unwrap_err().to_string();
    let known = "\"auto\", \"exact\", \"volume\", \"polynomial\", \"cylindrical\", \"second-order\", \"second-order-polynomial\"";
    assert_eq!(message, format!("no integral is called \"guess\"; there are {known}"));
}

#[test]
fn names_are_those_of_scenes_in_any_case() {
    assert_eq!(named::<Form>("integral", "Polynomial").unwrap(), Form::Polynomial);
    assert_eq!(named::<Kind>("kind of lengths", "LOG-normalised").unwrap(), Kind::LogNormalised);
    assert_eq!(named::<Texels>("kind of texels", "").unwrap(), Texels::Float);
}

#[test]
fn tables_are_judged_when_they_are_asked_for_and_then_drawn() {
    let mut session = session();
    let mesh = mesh();
    set(&mut session, &mesh, DMat4::IDENTITY);
    let exact = draw(&mut session);
    let mut far_from_exact = |choice: IntegrationOptions| {
        session.set_integral(choice).unwrap();
        draw(&mut session).compare(&exact).unwrap().rmse
    };
    let [first, fourth] =
        [1, 4].map(|degree| far_from_exact(IntegrationOptions { degree, ..IntegrationOptions::of(Form::Polynomial) }));
    assert!(fourth > 0.0 && fourth < first / 2.0, "{fourth} {first}");
    for (choice, part) in [
        (
            IntegrationOptions { table: Some([1, 64, 16]), ..IntegrationOptions::of(Form::Volume) },
            "at least 2, 2 and 3",
        ),
        (IntegrationOptions { degree: 9, ..IntegrationOptions::of(Form::Polynomial) }, "from 1 to 8, and not 9"),
        (IntegrationOptions { degree: 0, ..IntegrationOptions::of(Form::Polynomial) }, "from 1 to 8, and not 0"),
    ] {
        let message = session.set_integral(choice).unwrap_err().to_string();
        assert!(message.contains(part), "{message}");
    }
    assert!(draw(&mut session).compare(&exact).unwrap().rmse <= fourth, "what is refused changes nothing");
    session
        .set_integral(IntegrationOptions { degree: 0, table: Some([1; 3]), ..IntegrationOptions::default() })
        .unwrap();
    assert_eq!(draw(&mut session), exact, "what the exact integral does not read is not checked");
}

#[test]
fn points_that_are_not_finite_leave_out_their_cells_under_any_matrix() {
    let whole = mesh();
    let mut points = whole.points().to_vec();
    points[0].y = f64::NAN;
    let broken = Mesh::new(points.clone(), whole.cells().clone(), vec![], vec![]).unwrap();
    let values = |s: &mut Session| set_field(s, &whole);
    let mut plain = session();
    plain.set_mesh(&broken, DMat4::IDENTITY).unwrap();
    values(&mut plain);
    let expected = draw(&mut plain);
    assert!(expected.pixels.iter().any(|p| p[3] > 0.1));
    let there = DMat4::from_translation(DVec3::X * 1e-3);
    for matrix in [DMat4::IDENTITY, there, DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0))] {
        let mut other = session();
        other.set_mesh(&broken, matrix).unwrap();
        values(&mut other);
        let first = draw(&mut other);
        assert!(first.compare(&expected).unwrap().max < 0.03 || matrix.x_axis.x < 0.0);
        if matrix.x_axis.x > 0.0 {
            assert!(other.set_points(&points, DMat4::IDENTITY).unwrap());
            assert!(draw(&mut other).compare(&expected).unwrap().max < 2e-5);
            assert!(!other.set_points(whole.points(), matrix).unwrap());
            points.swap(0, 1);
            assert!(!other.set_points(&points, matrix).unwrap());
            points.swap(0, 1);
        }
    }
    // Not a cell is left, and then all are.
    let nowhere = vec![DVec3::NAN; points.len()];
    let mut empty = session();
    empty.set_mesh(&Mesh::new(nowhere.clone(), whole.cells().clone(), vec![], vec![]).unwrap(), there).unwrap();
    assert!(empty.set_points(&nowhere, DMat4::IDENTITY).unwrap());
    assert!(!empty.set_points(whole.points(), DMat4::IDENTITY).unwrap());
}

#[test]
fn what_a_session_logs_is_its_own() {
    let logs = [Log::default(), Log::default()];
    let [mut first, _second] = [0, 1].map(|i| Session::new(1, "cpu", "auto", logs[i].clone()).unwrap());
    let mut points = mesh().points().to_vec();
    points[0].x = f64::NAN;
    let broken = Mesh::new(points, mesh().cells().clone(), vec![], vec![]).unwrap();
    first.guarded(|s| s.set_mesh(&broken, DMat4::IDENTITY)).unwrap();
    let lines = logs[0].take();
    assert!(lines.iter().any(|l| l.starts_with("WARN") && l.contains("not finite")), "{lines:?}");
    assert!(logs[1].take().is_empty());
}
