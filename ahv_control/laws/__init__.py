# Copyright 2026 ahv developers, Apache-2.0
"""Laws that others have proposed, each in one file, by the protocol of `ahv_control.law`.

docs/laws.md says what each is, how it was tuned and what it does. A name that begins with an
underscore is no law: what some laws share, and the numbers of those that scripts compute.
"""
