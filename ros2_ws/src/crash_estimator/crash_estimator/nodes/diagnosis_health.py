"""How the diagnosis fares, for `/diagnostics`."""

from crash_replay.health import Health, Level

from .node_health import counts_of_samples, trouble_with_samples


def diagnosis_health(node) -> Health:
    """node: a DiagnosisNode."""
    progress, asked, busy = node.attending.progress(), node.asked, node.worker.busy
    values = {
        "model": node.structure.name,
        "revision": node.revision,
        "busy": busy,
        **counts_of_samples(progress),
        "last answer": node.telling.last or "none yet",
    }
    if not node.prepared:
        return Health(Level.OK, "compiles its code", values)
    if node.kept is None and not node.at_fault:
        return Health(Level.OK, "waits for a test", values)
    level, message = Level.OK, "waits for samples"
    if asked is not None:
        doing = "compares every candidate on all samples" if asked.final else "ranks the candidates"
        message = doing if busy else "has answered"
    level, message = trouble_with_samples(progress, node.attending, node.catching_up.came_at) or (level, message)
    if why := node.stopped or node.at_fault:
        level, message = Level.ERROR, f"stopped: {why}"
    return Health(level, message, values, node.kept.test.id if node.kept else "")
