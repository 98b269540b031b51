"""Which policies of a study have been trained, and by which learner."""

from dess.analysis.results.tables import Results


def trained_policies_by_learner(results: Results) -> dict[str, list[str]]:
    """The trained policies by learner; those of one learner differ in the seed of their training.

    A policy of a user that has weights is learned as well, and is a learner of its own.

    Returns:
        For the name of each learner its policies, in the order of the study.
    """
    policies: dict[str, list[str]] = {}
    for team in results.store.manifest.policies:
        first, *others = team.members
        if others or not first.weights:
            continue
        learner = first.learner or f"{team.policy} weights"
        policies.setdefault(learner, []).append(team.policy)
    names = [learner.rpartition(" ")[0] for learner in policies]  # without their last word
    unique = len({*names}) == len(names)
    if unique:
        return dict(zip(names, policies.values(), strict=True))
    return policies
