# Copyright 2026 ahv developers, Apache-2.0
"""Sine, cosine, arctangent, arcsine, exponential and logarithm from + - * / and sqrt alone.

The C library's own differ from machine to machine, cannot run in vector lanes, and would make the
three ways of `ahv_plant.numerics.elementwise` disagree. These have no branch and the same bits
everywhere; the tests hold them to a few units in the last place.
"""

from math import sqrt

from ahv_plant.numerics.elementwise import elementwise, select

TWO_OVER_PI = 0.6366197723675814  # [1/rad]
# pi/2 in three parts; the first two have 33 bits, so that n * part is exact for |n| < 2**20.
HALF_PI_1 = 1.5707963267341256  # [rad]
HALF_PI_2 = 6.077100506303966e-11  # [rad]
HALF_PI_3 = 2.0222662487959506e-21  # [rad]
HALF_PI = 1.5707963267948966  # [rad]
PI = 3.141592653589793  # [rad]
PI_REST = 1.2246467991473532e-16  # [rad] what PI lacks
QUARTER_PI = 0.7853981633974483  # [rad]
TAN_EIGHTH_PI = 0.41421356237309503  # [-]
# Adding and taking away 1.5 * 2**52 rounds a double of moderate size to the nearest integer.
ROUNDER = 6755399441055744.0  # [-]
LOG_1_34 = 0.29266961396282004  # [-]


@elementwise
def sin_cos(x: float) -> tuple[float, float]:
    """Sine and cosine of x [rad], |x| < 1e6: Cody-Waite reduction, then Taylor series."""
    n = (x * TWO_OVER_PI + ROUNDER) - ROUNDER
    r = ((x - n * HALF_PI_1) - n * HALF_PI_2) - n * HALF_PI_3
    z = r * r
    # Coefficients are 1/k! with alternating sign; |r| <= pi/4 leaves less than half a unit.
    tail = -1.0 / 39916800.0 + z * (1.0 / 6227020800.0 + z * (-1.0 / 1307674368000.0))
    tail = -1.0 / 5040.0 + z * (1.0 / 362880.0 + z * tail)
    s = r + r * z * (-1.0 / 6.0 + z * (1.0 / 120.0 + z * tail))
    tail = 1.0 / 479001600.0 + z * (-1.0 / 87178291200.0 + z * (1.0 / 20922789888000.0))
    tail = -1.0 / 720.0 + z * (1.0 / 40320.0 + z * (-1.0 / 3628800.0 + z * tail))
    c = 1.0 - 0.5 * z + z * z * (1.0 / 24.0 + z * tail)
    quadrant = n - 4.0 * ((n * 0.25 + ROUNDER) - ROUNDER)  # -2, -1, 0, 1 or 2
    odd = quadrant * quadrant == 1.0
    sine = select(odd, c, s)
    cosine = select(odd, s, c)
    upper_half = (quadrant == 0.0) | (quadrant == 1.0)
    right_half = (quadrant == 0.0) | (quadrant == -1.0)
    return select(upper_half, sine, -sine), select(right_half, cosine, -cosine)


@elementwise
def atan_ratio(y: float, x: float) -> float:
    """Arctangent [rad] of y / x for x > 0, reduced to |t| <= tan(pi/8) by two identities.

    The polynomial in t^2 interpolates (atan(t)/t - 1)/t^2 at Chebyshev nodes to 5e-18.
    """
    size = select(y < 0.0, -y, y)
    steep = size > x
    short = select(steep, x, size)
    long = select(steep, size, x)
    upper = short > TAN_EIGHTH_PI * long
    t = select(upper, short - long, short) / select(upper, short + long, long)
    z = t * t
    p = -0.0508544973794026 + z * (0.03923165829558719 + z * -0.01917688711906226)
    p = 0.07692183190826087 + z * (-0.06664511447381948 + z * (0.0585814891280221 + z * p))
    p = -0.14285714284666542 + z * (0.11111111015256361 + z * (-0.09090904578123903 + z * p))
    p = t + t * z * (-0.3333333333333333 + z * (0.1999999999999552 + z * p))
    p = select(upper, QUARTER_PI + p, p)
    p = select(steep, HALF_PI - p, p)
    return select(y < 0.0, -p, p)


@elementwise
def atan2(y: float, x: float) -> float:
    """Arctangent [rad] of y / x in the quadrant of x and y, from -pi to pi; not both are zero."""
    size = select(y < 0.0, -y, y)
    ahead = atan_ratio(size, abs(x))
    p = select(x < 0.0, PI - (ahead - PI_REST), ahead)
    return select(y < 0.0, -p, p)


@elementwise
def atan(x: float) -> float:
    """Arctangent [rad]."""
    return atan_ratio(x, 1.0)


@elementwise
def asin(x: float) -> float:
    """Arcsine [rad]; beyond -1 and 1 it stays at -pi/2 and pi/2."""
    rest = 1.0 - x * x
    inside = rest > 0.0
    edge = select(x > 0.0, HALF_PI, -HALF_PI)
    return select(inside, atan_ratio(x, sqrt(select(inside, rest, 1.0))), edge)


@elementwise
def log_near_one(x: float) -> float:
    """Natural logarithm [-] for 0.7 <= x <= 1.4, as temperature ratios are within a layer."""
    s = (x - 1.0) / (x + 1.0)  # log x = 2 atanh s
    z = s * s
    tail = 1.0 / 13.0 + z * (1.0 / 15.0 + z * (1.0 / 17.0 + z * (1.0 / 19.0 + z * (1.0 / 21.0))))
    tail = 1.0 / 7.0 + z * (1.0 / 9.0 + z * (1.0 / 11.0 + z * tail))
    return 2.0 * s + 2.0 * s * z * (1.0 / 3.0 + z * (1.0 / 5.0 + z * tail))


@elementwise
def exp_small(x: float) -> float:
    """Exponential [-] for |x| <= 10: Taylor at x/64, then six squarings."""
    r = x * 0.015625
    tail = 1.0 / 5040.0 + r * (1.0 / 40320.0 + r * (1.0 / 362880.0 + r * (1.0 / 3628800.0)))
    tail = 1.0 / 24.0 + r * (1.0 / 120.0 + r * (1.0 / 720.0 + r * tail))
    e = 1.0 + r * (1.0 + r * (0.5 + r * (1.0 / 6.0 + r * tail)))
    e = e * e
    e = e * e
    e = e * e
    e = e * e
    e = e * e
    return e * e


@elementwise
def power(x: float, p: float) -> float:
    """Power p [-] of x [-], 0.08 <= x <= 1 and |p| <= 2: two square roots bring x near one."""
    root = sqrt(sqrt(x))
    return exp_small(4.0 * p * (log_near_one(root * 1.34) - LOG_1_34))
