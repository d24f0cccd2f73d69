"""A second simulator of crash tests, written without a look at the first (`synthetic`) or at the estimators.

A diagnosis that is tuned on one simulator learns that simulator's formulas. This one writes the same physics as other
engineers write it: switching laws with located events, internal states, crush curves that unload along lines of their
own, and sensors that ring, drift, clip and are mounted askew. It imports numpy, scipy and `recording`, and nothing
else of the project.

    curves      force over crush
    branches    what stands beside a curve: friction, dampers, hysteresis, and what no vocabulary has
    joint       an element between two bodies: contact, unloading, gap, rate, branches
    machine     bodies and joints, integrated from event to event
    structures  the four crash tests, drawn from a seed
    forms       each hidden effect in each of its forms, sized by the physics
    sensors     what is recorded of the motion
    cases       a case by its name
    plan        which cases are judged
"""
