"""Rigs with a hidden effect: measurements to try the commands on, made without the models.

The rig's equations are written here in other symbols and often in another form than the library's,
and scipy integrates them adaptively. Nothing here imports a law, an effect or a fit: the answer can
be found only from the measurements.

    damper.py    the force of a damper and what is hidden in it
    hidden.py    what can be hidden, drawn within plausible bounds
    excitation.py motions, ground motions and voltage programmes
    bench.py     a damper under prescribed motion
    tower.py     a base-isolated building on a shake table
    rigs.py      the numbers of a rig, drawn from its seed
    recorder.py  the instruments with their noise, and the files
    sealed.py    the answer, kept where nobody reads it by accident
    make.py      files, description and study
    planned.py   motions and commands of a plan
    perform.py   the true rig performs a plan
"""
