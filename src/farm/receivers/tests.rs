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
