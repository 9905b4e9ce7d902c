use std::collections::VecDeque;

use kilauea_math::DAffine3;
use kilauea_scene::{
    Attribute, InstanceAttribute, Instances, Interpolation, SceneError, Visibility,
};

use crate::bounds::is_singular;
use crate::channel::{Channel, Counts, Domain};
use crate::payload::{InstancesPayload, Primvar};
use crate::report::Report;

/// Where the contents of a payload prototype end up.
#[derive(Clone, Debug)]
pub(crate) struct Home {
    /// Index into [`Plan::roots`], and so into the scene's prototypes.
    pub(crate) root: usize,
    pub(crate) root_from_prototype: DAffine3,
    /// Primvars of the instances on the way there.
    pub(crate) overrides: Vec<Attribute>,
    /// Rays that all instances on the way there let in.
    pub(crate) visibility: Visibility,
}

/// The instance graph after prototypes that are placed once were merged into their parents.
#[derive(Debug)]
pub(crate) struct Plan {
    /// By payload prototype; absent where nothing places it.
    pub(crate) homes: Vec<Option<Home>>,
    /// Payload prototype of each scene prototype, parents before what they place; the world first.
    pub(crate) roots: Vec<usize>,
    /// By scene prototype.
    pub(crate) instances: Vec<Vec<Instances>>,
}

/// An instancer whose transforms all have inverses.
struct Placements {
    prim_idx: u32,
    parent: usize,
    prototype: usize,
    parent_from_prototype: Vec<DAffine3>,
    later_parent_from_prototype: Vec<Vec<DAffine3>>,
    attributes: Vec<InstanceAttribute>,
    visibility: Visibility,
}

impl Placements {
    /// Whether a prototype that nothing else places can become a part of the parent.
    fn is_one_that_stands_still(&self) -> bool {
        self.parent_from_prototype.len() == 1 && self.later_parent_from_prototype.is_empty()
    }
}

impl Plan {
    /// `first_prim_idx` is the primId of the first instancer.
    pub(crate) fn new(
        prototypes: &[String],
        payloads: &[InstancesPayload<'_>],
        first_prim_idx: u32,
        report: &mut Report,
    ) -> Result<Self, SceneError> {
        let mut placements = Vec::with_capacity(payloads.len());
        for (payload, prim_idx) in payloads.iter().zip(first_prim_idx..) {
            for (attribute, index) in [("parent", payload.parent), ("prototype", payload.prototype)]
            {
                check_prototype(payload.path, attribute, index, prototypes.len())?;
            }
            placements.push(place(payload, prim_idx, report));
        }
        let order = topological_order(prototypes, &placements)?;
        let mut plan = Self {
            homes: vec![None; prototypes.len()],
            roots: Vec::new(),
            instances: Vec::new(),
        };
        let mut of_prototype: Vec<Vec<usize>> = vec![Vec::new(); prototypes.len()];
        for (i, p) in placements.iter().enumerate() {
            of_prototype[p.prototype].push(i);
        }
        for prototype in order {
            plan.settle(prototype, &of_prototype[prototype], &placements);
        }
        for p in placements {
            plan.keep_instances(p);
        }
        Ok(plan)
    }

    /// Gives a prototype its home, now that all of its parents have theirs.
    fn settle(&mut self, prototype: usize, placed_by: &[usize], placements: &[Placements]) {
        let reached = || {
            placed_by
                .iter()
                .map(|&i| &placements[i])
                .filter_map(|p| self.homes[p.parent].as_ref().map(|home| (p, home)))
        };
        let n: usize = reached().map(|(p, _)| p.parent_from_prototype.len()).sum();
        let only = reached().find(|(p, _)| p.is_one_that_stands_still());
        let home = match (prototype, n, only) {
            (0, ..) => self.new_root(prototype),
            (_, 0, _) => return,
            (_, 1, Some((p, parent))) => {
                let own = p.attributes.iter().map(|a| Attribute {
                    name: a.name.clone(),
                    width: a.width,
                    interpolation: Interpolation::Constant,
                    data: a.data.clone(),
                });
                let mut overrides: Vec<Attribute> = own.collect();
                let inherited = inherited(&parent.overrides, |name| {
                    overrides.iter().any(|o| o.name == name)
                });
                overrides.extend(inherited);
                Home {
                    root: parent.root,
                    root_from_prototype: parent.root_from_prototype * p.parent_from_prototype[0],
                    overrides,
                    visibility: parent.visibility & p.visibility,
                }
            }
            _ => self.new_root(prototype),
        };
        self.homes[prototype] = Some(home);
    }

    fn new_root(&mut self, prototype: usize) -> Home {
        self.roots.push(prototype);
        self.instances.push(Vec::new());
        Home {
            root: self.roots.len() - 1,
            root_from_prototype: DAffine3::IDENTITY,
            overrides: Vec::new(),
            visibility: Visibility::ALL,
        }
    }

    /// Moves placements of a prototype that was not merged into the root that holds them.
    fn keep_instances(&mut self, p: Placements) {
        let (Some(parent), Some(child)) = (&self.homes[p.parent], &self.homes[p.prototype]) else {
            return;
        };
        if self.roots[child.root] != p.prototype || p.parent_from_prototype.is_empty() {
            return;
        }
        let mut attributes = p.attributes;
        let n = p.parent_from_prototype.len();
        let inherited = inherited(&parent.overrides, |name| {
            attributes.iter().any(|a| a.name == name)
        });
        attributes.extend(inherited.into_iter().map(|o| InstanceAttribute {
            name: o.name,
            width: o.width,
            data: o.data.repeat(n),
        }));
        let in_root = |matrices: Vec<DAffine3>| {
            let matrices = matrices.into_iter();
            matrices.map(|m| parent.root_from_prototype * m).collect()
        };
        let instances = Instances {
            prim_idx: p.prim_idx,
            prototype: child.root as u32,
            parent_from_prototype: in_root(p.parent_from_prototype),
            later_parent_from_prototype: p
                .later_parent_from_prototype
                .into_iter()
                .map(in_root)
                .collect(),
            visibility: parent.visibility & p.visibility,
            attributes,
        };
        self.instances[parent.root].push(instances);
    }
}

/// The nearest instancer's primvar wins over those further out.
fn inherited(outer: &[Attribute], has_own: impl Fn(&str) -> bool) -> Vec<Attribute> {
    outer
        .iter()
        .filter(|o| !has_own(&o.name))
        .cloned()
        .collect()
}

/// Checks an index into the payload's prototypes.
pub(crate) fn check_prototype(
    path: &str,
    attribute: &str,
    index: u32,
    n_prototypes: usize,
) -> Result<(), SceneError> {
    if (index as usize) < n_prototypes {
        return Ok(());
    }
    Err(SceneError::Index {
        path: path.to_owned(),
        attribute: attribute.to_owned(),
        at: 0,
        value: index.into(),
        limit: n_prototypes,
    })
}

/// Leaves out instances without an inverse, and primvars that do not fit.
fn place(payload: &InstancesPayload<'_>, prim_idx: u32, report: &mut Report) -> Placements {
    let all = &payload.parent_from_prototype;
    let mut later = &payload.later_parent_from_prototype[..];
    if later.iter().any(|key| key.len() != all.len()) {
        let what = "their number changes while the shutter is open; no motion";
        report.warn(payload.path, "transforms", what);
        later = &[];
    }
    let is_regular = |i: usize| {
        let at_keys = later.iter().map(|key| &key[i]);
        !std::iter::once(&all[i]).chain(at_keys).any(is_singular)
    };
    let kept: Vec<u32> = (0..all.len() as u32)
        .filter(|&i| is_regular(i as usize))
        .collect();
    if kept.len() < all.len() {
        let n = all.len() - kept.len();
        let what = format_args!("{n} instances of no extent or not finite skipped");
        report.warn(payload.path, "transforms", what);
    }
    let attributes = payload.primvars.iter().filter_map(|primvar| {
        per_instance(primvar, all.len(), &kept)
            .map_err(|what| {
                let what = format_args!("{what}; primvar ignored");
                report.warn(payload.path, &format!("primvars:{}", primvar.name), what);
            })
            .ok()
    });
    let attributes = attributes.collect();
    let select = |all: &Vec<DAffine3>| kept.iter().map(|&i| all[i as usize]).collect();
    Placements {
        prim_idx,
        parent: payload.parent as usize,
        prototype: payload.prototype as usize,
        attributes,
        parent_from_prototype: select(all),
        later_parent_from_prototype: later.iter().map(select).collect(),
        visibility: payload.visibility,
    }
}

fn per_instance(
    primvar: &Primvar<'_>,
    n_instances: usize,
    kept: &[u32],
) -> Result<InstanceAttribute, String> {
    let counts = Counts {
        points: n_instances,
        faces: n_instances,
        corners: n_instances,
    };
    let channel = Channel::from_primvar(primvar, counts)?;
    if channel.values.iter().any(|x| !x.is_finite()) {
        return Err("has values that are not finite".to_owned());
    }
    let value = |&i: &u32| match channel.domain {
        Domain::Constant => channel.value(0),
        _ => channel.value(i),
    };
    Ok(InstanceAttribute {
        name: primvar.name.to_owned(),
        width: primvar.width,
        data: kept.iter().flat_map(value).copied().collect(),
    })
}

/// Prototypes with all parents before their children (Kahn 1962).
fn topological_order(
    prototypes: &[String],
    placements: &[Placements],
) -> Result<Vec<usize>, SceneError> {
    let mut n_open_parents = vec![0_usize; prototypes.len()];
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); prototypes.len()];
    for p in placements {
        n_open_parents[p.prototype] += 1;
        children[p.parent].push(p.prototype);
    }
    let is_free = |&p: &usize| n_open_parents[p] == 0;
    let mut free: VecDeque<usize> = (0..prototypes.len()).filter(is_free).collect();
    let mut order = Vec::with_capacity(prototypes.len());
    while let Some(prototype) = free.pop_front() {
        order.push(prototype);
        for &child in &children[prototype] {
            n_open_parents[child] -= 1;
            if n_open_parents[child] == 0 {
                free.push_back(child);
            }
        }
    }
    match n_open_parents.iter().position(|&n| n > 0) {
        None => Ok(order),
        Some(prototype) => Err(SceneError::Cycle {
            path: prototypes[prototype].clone(),
        }),
    }
}

#[cfg(test)]
mod tests {
    use kilauea_math::DVec3;

    use super::*;

    fn instances(parent: u32, prototype: u32, shifts: &[f64]) -> InstancesPayload<'static> {
        InstancesPayload {
            path: "/instancer",
            parent,
            prototype,
            parent_from_prototype: shifts
                .iter()
                .map(|&x| DAffine3::from_translation(DVec3::X * x))
                .collect(),
            later_parent_from_prototype: Vec::new(),
            primvars: Vec::new(),
            visibility: Visibility::ALL,
        }
    }

    fn plan(n: usize, payloads: &[InstancesPayload<'_>]) -> Result<Plan, SceneError> {
        let paths: Vec<String> = (0..n).map(|i| format!("/p{i}")).collect();
        Plan::new(&paths, payloads, 0, &mut Report::default())
    }

    #[test]
    fn prototypes_placed_once_are_merged() {
        // World places 1 once, 1 places 2 twice, 2 places 3 once; nothing places 4.
        let plan = plan(
            5,
            &[
                instances(2, 3, &[100.0]),
                instances(1, 2, &[10.0, 20.0]),
                instances(0, 1, &[1.0]),
            ],
        )
        .unwrap();
        assert_eq!(plan.roots, [0, 2]);
        let home = |p: usize| {
            let home = plan.homes[p].as_ref()?;
            Some((home.root, home.root_from_prototype.translation.x))
        };
        assert_eq!(home(0), Some((0, 0.0)));
        assert_eq!(home(1), Some((0, 1.0)));
        assert_eq!(home(2), Some((1, 0.0)));
        assert_eq!(home(3), Some((1, 100.0)));
        assert_eq!(home(4), None);
        assert_eq!(plan.instances[0].len(), 1);
        let kept = &plan.instances[0][0];
        assert_eq!((kept.prototype, kept.prim_idx), (1, 1));
        let shifts: Vec<f64> = kept
            .parent_from_prototype
            .iter()
            .map(|m| m.translation.x)
            .collect();
        assert_eq!(shifts, [11.0, 21.0]);
    }

    #[test]
    fn two_placements_of_one_each_stay_instances() {
        let plan = plan(2, &[instances(0, 1, &[1.0]), instances(0, 1, &[2.0])]).unwrap();
        assert_eq!(plan.roots, [0, 1]);
        assert_eq!(plan.instances[0].len(), 2);
    }

    #[test]
    fn what_moves_stays_an_instance_and_takes_along_what_stands_still_in_it() {
        let mut moving = instances(0, 1, &[1.0]);
        let later = [2.0, 3.0].map(|x| vec![DAffine3::from_translation(DVec3::X * x)]);
        moving.later_parent_from_prototype = later.to_vec();
        let plan = plan(3, &[moving, instances(1, 2, &[10.0])]).unwrap();
        assert_eq!(plan.roots, [0, 1]);
        assert_eq!(plan.homes[2].as_ref().map(|home| home.root), Some(1));
        let later = &plan.instances[0][0].later_parent_from_prototype;
        assert_eq!(later.len(), 2);
        assert_eq!(later[1][0].translation.x, 3.0);
    }

    #[test]
    fn visibility_narrows_on_the_way_in() {
        let mut unseen = instances(0, 1, &[1.0]);
        unseen.visibility = Visibility::SHADOW | Visibility::INDIRECT;
        let mut no_shadow = instances(1, 2, &[1.0]);
        no_shadow.visibility = Visibility::CAMERA | Visibility::INDIRECT;
        let plan = plan(3, &[unseen, no_shadow]).unwrap();
        let home = plan.homes[2].as_ref().unwrap();
        assert_eq!(home.visibility, Visibility::INDIRECT);
    }

    #[test]
    fn instance_primvars_follow_the_contents() {
        let color = |values: &'static [f32], interpolation: &str| Primvar {
            name: "displayColor",
            width: 1,
            interpolation: interpolation.parse().unwrap(),
            values,
            indices: None,
        };
        let mut outer = instances(0, 1, &[1.0, 0.0]);
        outer.parent_from_prototype[1] = DAffine3::from_scale(DVec3::ZERO);
        outer.primvars = vec![color(&[0.25, 0.75], "vertex")];
        let inner = instances(1, 2, &[10.0, 20.0]);
        let plan = plan(3, &[outer, inner]).unwrap();
        // The singular instance is gone, so that prototype 1 is merged.
        let overrides = &plan.homes[1].as_ref().unwrap().overrides;
        assert_eq!(overrides[0].data, [0.25]);
        assert_eq!(plan.instances[0][0].attributes[0].data, [0.25, 0.25]);
    }

    #[test]
    fn cycles_and_bad_indices_are_errors() {
        let cycle = plan(3, &[instances(1, 2, &[0.0]), instances(2, 1, &[0.0])]);
        assert!(matches!(cycle, Err(SceneError::Cycle { .. })));
        assert!(matches!(
            plan(1, &[instances(0, 0, &[0.0])]),
            Err(SceneError::Cycle { .. })
        ));
        assert!(matches!(
            plan(2, &[instances(0, 2, &[0.0])]),
            Err(SceneError::Index { .. })
        ));
    }
}
