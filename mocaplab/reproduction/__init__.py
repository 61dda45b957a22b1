"""Paper A's figures (and two of paper B's) redone, with a verdict on every claim.

``mocaplab reproduce`` runs it. From below: ``verdicts`` (the rules), ``needs`` (what is trained
and tested), ``costs`` and ``plan`` (what a budget is enough for), ``scores`` (errors by clip),
``plots``, ``networks_inside`` and ``sources`` (what errors do not show), ``claims``, ``figures``,
``driver``.
"""
