use super::*;
use crate::scene::Model;

fn parsed(text: &str) -> (Job, Scene) {
    let job = Job::parse(text, "test.toml").unwrap();
    let scene = Scene::new(Model::default(), &job).unwrap();
    (job, scene)
}

#[test]
fn bins_far_from_the_horizon_are_told_by_their_centres_as_by_a_search() {
    for normal in [[0.3, 0.8, -0.5], [0.0, 1.0, 0.0], [-1.0, 0.01, 0.0]] {
        let (job, scene) = parsed(&format!(
            "[[gonio]]\nname = \"leaving\"\nposition = [0, 0, 0]\nsurface = true\nnormal = {normal:?}\nwidth = 64\n\
             height = 32\n[[plane]]\npoint = [0, 0, 0]\nnormal = {normal:?}\nreflectance = 0.5\n\
             [[source]]\nkind = \"omni\"\nposition = [0, 2, 0]\nintensity = 1\n"
        ));
        let set = ReceiverSet::all(&job, &scene, &[]).remove(0);
        let Bins::Film { eye: eye @ Eye::Surface { point }, .. } = &set.bins else { panic!("a surface goniometer") };
        let mut searched = 0;
        for i in 0..set.shape.bins() {
            assert_eq!(set.sights[i], set.probe(eye, i), "{normal:?}, bin {i}");
            searched += usize::from(set.sight_by_centre(point.normal, i).is_none());
        }
        assert!(5 * searched < 2 * set.shape.bins(), "{normal:?}: {searched} bins were searched");
        assert!([Sight::Above, Sight::Across, Sight::Below].iter().all(|sight| set.sights.contains(sight)));
    }
}

/// Two lamps, a lux-meter on the first and another beside it, and a grid with the second in its cell [1, 0].
const ON_LAMPS: &str = r#"
[[point]]
name = "lamp"
position = [0.1, 2.0, 0.3]
normal = [0.0, 1.0, 0.0]
[[point]]
name = "beside"
position = [0.1, 2.1, 0.3]
normal = [0.0, -1.0, 0.0]
[[grid]]
name = "row"
origin = [0.0, 1.0, 0.0]
u = [4.0, 0.0, 0.0]
v = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
columns = 4
rows = 1
[[source]]
kind = "omni"
position = [0.1, 2.0, 0.3]
intensity = 100.0
[[source]]
kind = "omni"
position = [1.5, 1.0, 0.5]
intensity = 100.0
"#;

#[test]
fn a_lamp_gives_a_meter_on_it_nothing_and_the_plan_says_so() {
    let (job, scene) = parsed(ON_LAMPS);
    let warnings = ReceiverSet::check(&job, &scene, "test.toml").unwrap();
    let what = "lies on a lamp without extent, where illuminance has no finite value";
    assert_eq!(warnings, [format!("point lamp {what}"), format!("grid row, cell [1, 0] {what}")]);
    let sets = ReceiverSet::all(&job, &scene, &[]);
    // What the other lamp gives stays: cell [1, 0] lies below the first one.
    let way = DVec3::new(1.4, -1.0, 0.2);
    let expected = 100.0 / way.length_squared() * (1.0 / way.length());
    let cell = sets[0].fixed_direct(&scene, &[1])[0];
    assert!((cell / expected - 1.0).abs() < 1e-12, "{cell} {expected}");
    assert_eq!(sets[1].fixed_direct(&scene, &[0])[0], 0.0, "the other lamp is below the plane of this meter");
    assert!(sets[2].fixed_direct(&scene, &[0])[0] > 9999.0, "a decimetre away all is as it was");
}

/// Which of the 4 x 2 pixels that look down on a floor, two of each row on either side of its edge x = 0, lie across an edge.
fn across(model: &str, more: &str) -> Vec<bool> {
    let (job, scene) = parsed(&format!(
        "{model}[[camera]]\nname = \"down\"\neye = [0.01, 4.0, 0.01]\ntarget = [0.01, 0.0, 0.01]\nup = [0, 0, -1]\n\
         vertical_fov_degrees = 20\nwidth = 4\nheight = 2\n[[source]]\nkind = \"omni\"\nposition = [0, 3, 0]\nintensity = 1\n{more}"
    ));
    ReceiverSet::all(&job, &scene, &[]).remove(0).edges
}

const FLOOR: &str = "[[plane]]\npoint = [0, 0, 0]\nnormal = [0, 1, 0]\nreflectance = 0.5\n";

#[test]
fn bins_lie_across_an_edge_where_their_corners_show_different_surfaces() {
    let none = [false; 8];
    assert_eq!(across(FLOOR, ""), none, "one plane");
    // A wall down from the floor's level and another plane, from x = 0.3 on: the corners of the third column see both.
    let wall = "[[plane]]\npoint = [0.3, 0, 0]\nnormal = [-1, 0.05, 0]\nreflectance = 0.5\n";
    let third = [false, false, true, false, false, false, true, false];
    assert_eq!(across(FLOOR, wall), third, "floor and wall");
    let reverse = "[transport]\nestimator = \"reverse\"\n";
    assert_eq!(across(FLOOR, &(wall.to_owned() + reverse)), [false; 0], "paths in reverse draw one position a stratum");
}
