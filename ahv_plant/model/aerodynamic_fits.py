# Copyright 2026 ahv developers, Apache-2.0
"""The 22 aerodynamic polynomials of the winged-cone vehicle, in Horner form.

Fits by Keshmiri, Colgren and Mirmirani (2005), which the report cites in section 2.2 and does not
print. Arguments: `a` angle of attack [deg], `m` Mach number [-], `d` deflection [deg]. Local
names: `c2` multiplies a^2, `d1` multiplies d^1, `m2` is m^2. Control-surface polynomials return
their value and their slope by d [1/deg]. The fits hold above Mach 4. The figures are those of
test/data/aero_coefficients.csv; a test compares them term by term.
"""

from ahv_plant.numerics.elementwise import elementwise


@elementwise
def CL_basic(a: float, m: float) -> float:
    """Basic lift C_La [-]."""
    m2 = m * m
    c0 = -0.0819 + m * (0.047 + m * (-0.00919 + m * (0.000774 + m * (-2.93e-05 + m * 4.12e-07))))
    c1 = 0.0186 + m * -0.000473
    c2 = -0.000152 + m2 * 5.99e-07
    return c0 + a * (c1 + a * (c2 + a * (4.08e-06 + a * (-3.91e-07 + a * 1.3e-08))))


@elementwise
def CL_elevon(a: float, m: float, d: float) -> tuple[float, float]:
    """Lift of one elevon at d [deg] and its slope, C_L,de."""
    d0 = -1.45e-05 + m * 7.1e-06 + a * (0.000101 + m * 4.7e-06)
    d1 = -0.000414 + m * 8.72e-06 + a * (-3.51e-06 + m * -1.7e-07)
    return d0 + d * d1, d1


@elementwise
def CD_basic(a: float, m: float) -> float:
    """Basic drag C_Da [-]."""
    m2 = m * m
    c0 = 0.08717 + m * (
        -0.03307 + m * (0.005036 + m * (-0.0003658 + m * (1.274e-05 + m * -1.705e-07)))
    )
    c1 = 0.003179 + m * -0.000125
    c2 = -0.0011 + m2 * 1.405e-07
    return c0 + a * (c1 + a * (c2 + a * (0.0003175 + a * (-2.985e-05 + a * 9.766e-07))))


@elementwise
def CD_elevon(a: float, m: float, d: float) -> tuple[float, float]:
    """Drag of one elevon at d [deg] and its slope, C_D,de."""
    a2 = a * a
    m2 = m * m
    d0 = 0.00045548 + m * (-0.00011436 + m * 3.014e-06) + a * (2.5411e-05 + a * 3.2187e-06)
    d1 = -3.6417e-05 + a * (m * -5.3015e-07)
    d2 = 6.9629e-06 + a2 * (m2 * 2.1026e-12)
    return d0 + d * (d1 + d * d2), d1 + d * (2.0 * d2)


@elementwise
def CD_rudder(a: float, m: float, d: float) -> tuple[float, float]:
    """Drag of the rudder at d [deg] and its slope, C_D,dr."""
    a2 = a * a
    m2 = m * m
    d0 = 0.00075 + m * (-9.69e-05 + m * 2.7e-06) + a * (-2.29e-05 + a * 8.76e-07)
    d1 = -1.83e-06 + a * (m * 9.13e-09)
    d2 = 1.97e-06 + a2 * (m2 * -1.77e-11)
    return d0 + d * (d1 + d * d2), d1 + d * (2.0 * d2)


@elementwise
def CY_beta(a: float, m: float) -> float:
    """Side force due to sideslip, C_Y,beta [1/rad]."""
    m2 = m * m
    c0 = m * (-0.29253 + m * (0.054822 + m * (-0.0043203 + m * (0.00015495 + m * -2.0829e-06))))
    c1 = 0.0028803 + m * -0.00028943
    c2 = 0.00073535 + m2 * (4.6205e-06 + m2 * -4.649e-09)
    c4 = 2.8183e-05 + m2 * (-2.0675e-08 + m2 * 2.6144e-11)
    return c0 + a * (c1 + a * (c2 + a * (-0.00037405 + a * (c4 + a * -5.2083e-07))))


@elementwise
def CY_elevon(a: float, m: float, d: float) -> tuple[float, float]:
    """Side force of the right elevon at d [deg], and slope, C_Y,de; the left one is opposite."""
    a2 = a * a
    m2 = m * m
    d0 = -1.02e-06 + m * (4.48e-07 + m * -2.36e-08) + a * (-1.12e-07 + a * 2.82e-09)
    d1 = 2.27e-07 + a * (m * 4.11e-09)
    d2 = -5.04e-08 + a2 * (m2 * 4.5e-14)
    return d0 + d * (d1 + d * d2), d1 + d * (2.0 * d2)


@elementwise
def CY_rudder(a: float, m: float, d: float) -> tuple[float, float]:
    """Side force of the rudder at d [deg] and its slope, C_Y,dr."""
    d0 = -1.43e-18 + m * 1.86e-19 + a * 4.86e-20
    d1 = 0.000384 + m * -1.07e-05 + a * (-1.17e-05 + m * 2.6e-07)
    return d0 + d * d1, d1


@elementwise
def Cl_beta(a: float, m: float) -> float:
    """Rolling moment due to sideslip, C_l,beta [1/rad]."""
    m2 = m * m
    c0 = -0.1402 + m * (
        0.03326 + m * (-0.003794 + m * (0.0002219 + m * (-6.462e-06 + m * 7.419e-08)))
    )
    c1 = -0.000759 + m * 8.596e-06
    c2 = 2.354e-06 + m2 * -1.044e-08
    return c0 + a * (c1 + a * (c2 + a * (-8.964e-18 + a * (3.803e-19 + a * -3.353e-21))))


@elementwise
def Cl_elevon(a: float, m: float, d: float) -> tuple[float, float]:
    """Rolling moment of the right elevon at d [deg], slope, C_l,de; the left one is opposite."""
    a2 = a * a
    m2 = m * m
    d0 = 0.000357 + m * (-3.598e-05 + m * 1.411e-06) + a * (-9.569e-05 + a * 4.95e-06)
    d1 = 0.000117 + a * (m * 2.794e-08)
    d2 = -1.16e-06 + a2 * (m2 * -4.641e-11)
    return d0 + d * (d1 + d * d2), d1 + d * (2.0 * d2)


@elementwise
def Cl_rudder(a: float, m: float, d: float) -> tuple[float, float]:
    """Rolling moment of the rudder at d [deg] and its slope, C_l,dr."""
    d0 = -5.0103e-19 + m * 2.3418e-20 + a * (6.2723e-20 + m * -3.4201e-21)
    d1 = 0.00011441 + m * -3.5496e-06 + a * (-2.6824e-06 + m * 5.5547e-08)
    return d0 + d * d1, d1


@elementwise
def Cl_p(a: float, m: float) -> float:
    """Roll damping C_l,p, per Pb/2V [1/rad]."""
    m2 = m * m
    c0 = -0.299 + m * (0.0747 + m * (-0.00913 + m * (0.000573 + m * (-1.79e-05 + m * 2.2e-07))))
    c1 = 0.00138 + m * -8.78e-05
    c2 = -0.000204 + m2 * -1.52e-07
    return c0 + a * (c1 + a * (c2 + a * (-3.86e-05 + a * (4.21e-06 + a * -1.15e-07))))


@elementwise
def Cl_r(a: float, m: float) -> float:
    """Rolling moment due to yaw rate C_l,r, per Rb/2V [1/rad]."""
    m2 = m * m
    c0 = 0.382 + m * (-0.106 + m * (0.0145 + m * (-0.00102 + m * (3.56e-05 + m * -4.81e-07))))
    c1 = 0.00194 + m * -8.15e-05
    c2 = -9.76e-06 + m2 * 4.49e-08
    return c0 + a * (c1 + a * (c2 + a * (-2.7e-07 + a * (3.19e-08 + a * -1.06e-09))))


@elementwise
def Cm_basic(a: float, m: float) -> float:
    """Basic pitching moment C_ma [-]."""
    m2 = m * m
    c0 = -0.02192 + m * (
        0.007739 + m * (-0.0008849 + m * (4.617e-05 + m * (-1.143e-06 + m * 1.082e-08)))
    )
    c1 = -0.00226 + m * 0.0001808
    c2 = 0.0002616 + m2 * -2.88e-07
    return c0 + a * (c1 + a * (c2 + a * (-7.887e-05 + a * (8.288e-06 + a * -2.789e-07))))


@elementwise
def Cm_elevon(a: float, m: float, d: float) -> tuple[float, float]:
    """Pitching moment of one elevon at d [deg] and its slope, C_m,de."""
    d0 = -5.67e-05 + m * -1.51e-06 + a * (-6.59e-05 + m * -4.46e-06)
    d1 = 0.000289 + m * -5.87e-06 + a * (4.48e-06 + m * 9.72e-08)
    return d0 + d * d1, d1


@elementwise
def Cm_rudder(a: float, m: float, d: float) -> tuple[float, float]:
    """Pitching moment of the rudder at d [deg] and its slope, C_m,dr."""
    m2 = m * m
    c0 = 0.00158 + m * (
        -0.000669 + m * (0.000105 + m * (-7.74e-06 + m * (2.7e-07 + m * -3.58e-09)))
    )
    c4 = -2.1e-08 + a * (3.14e-09 + a * (-2.18e-10 + a * 5.74e-12))
    d0 = m2 * c0 + a * (-2.79e-05 + a * (-5.89e-08 + a * (6.42e-08 + a * c4)))
    d3 = d * d * d
    value = d0 + d3 * d * (1.43e-07 + d * (-4.77e-22 + d * (-3.38e-10 + d * 2.63e-24)))
    s5 = 5.0 * -4.77e-22 + d * (6.0 * -3.38e-10 + d * (7.0 * 2.63e-24))
    slope = d3 * (4.0 * 1.43e-07 + d * s5)
    return value, slope


@elementwise
def Cm_q(a: float, m: float) -> float:
    """Pitch damping C_m,q, per Qc/2V [1/rad]."""
    m2 = m * m
    c0 = -1.36 + m * (0.386 + m * (-0.0542 + m * (0.0038 + m * (-0.00013 + m * 1.71e-06))))
    c1 = 0.000785 + m * 0.00014
    c2 = 0.00236 + m2 * -1.95e-06
    return c0 + a * (c1 + a * (c2 + a * (-0.00148 + a * (0.000169 + a * -5.93e-06))))


@elementwise
def Cn_beta(a: float, m: float) -> float:
    """Yawing moment due to sideslip, C_n,beta [1/rad]."""
    m2 = m * m
    m3 = m2 * m
    m4 = m2 * m2
    m5 = m4 * m
    c0 = m * (0.059115 + m * (-0.014824 + m * (0.0012692 + m * (-4.7098e-05 + m * 6.4284e-07))))
    c1 = 0.0006998 + m * -7.525e-05
    c2 = 0.0002516 + m2 * -2.1924e-07
    c3 = -0.00010777 + m3 * 1.0707e-08
    c4 = 9.4989e-06 + m4 * -5.5472e-11
    c5 = -2.5953e-07 + m5 * 8.5863e-14
    return c0 + a * (c1 + a * (c2 + a * (c3 + a * (c4 + a * c5))))


@elementwise
def Cn_elevon(a: float, m: float, d: float) -> tuple[float, float]:
    """Yawing moment of the right elevon at d [deg], slope, C_n,de; the left one is opposite."""
    a2 = a * a
    m2 = m * m
    d0 = 0.00021 + m * (-3.56e-05 + m * 8.16e-07) + a * (1.83e-05 + a * -6.39e-07)
    d1 = -1.3e-05 + a * (m * -8.93e-08)
    d2 = 1.97e-06 + a2 * (m2 * 1.41e-11)
    return d0 + d * (d1 + d * d2), d1 + d * (2.0 * d2)


@elementwise
def Cn_rudder(a: float, m: float, d: float) -> tuple[float, float]:
    """Yawing moment of the rudder at d [deg] and its slope, C_n,dr."""
    d0 = 2.85e-18 + m * -1.26e-19 + a * (-3.59e-19 + m * 1.57e-20)
    d1 = -0.000528 + m * 1.65e-05 + a * (1.39e-05 + m * -3.13e-07)
    return d0 + d * d1, d1


@elementwise
def Cn_p(a: float, m: float) -> float:
    """Yawing moment due to roll rate C_n,p, per Pb/2V [1/rad]."""
    c0 = 0.368 + m * (-0.0979 + m * (0.0124 + m * (-0.000805 + m * (2.57e-05 + m * -3.2e-07))))
    return c0 + a * (7.61e-16 + a * (-4.64e-16 + a * (1.01e-16 + a * (-9.18e-18 + a * 2.96e-19))))


@elementwise
def Cn_r(a: float, m: float) -> float:
    """Yaw damping C_n,r, per Rb/2V [1/rad]."""
    m2 = m * m
    c0 = -2.41 + m * (0.596 + m * (-0.0757 + m * (0.0049 + m * (-0.000157 + m * 1.96e-06))))
    c1 = -0.00274 + m * 0.000209
    c2 = 0.00115 + m2 * -6.53e-08
    return c0 + a * (c1 + a * (c2 + a * (-0.000387 + a * (3.6e-05 + a * -1.18e-06))))
