"""The equations of nine points and their derivatives.

In isotropic coordinates a point p is the pair (p, p^), where p^ is the conjugate of real points and a variable of its
own in general. From the first point P0, a and b are the pivots, x and y the vectors to the moving pivots of the coupler
in its first position, and d_j the other points. The coupler has turned by e^{i theta_j} = 1 + g_j, and both links keep
their length::

    (a^ - d_j^) x g_j + (a - d_j) x^ g_j^ + d_j (a^ - x^) + d_j^ (a - x) - d_j d_j^ = 0,    the same with (b, y)
    g_j + g_j^ + g_j g_j^ = 0

Cramer's rule leaves eight equations for the eight unknowns z = (x, x^, a, a^, y, y^, b, b^) (C. W. Wampler, A. P.
Morgan, A. J. Sommese, Complete solution of the nine-point path synthesis problem for four-bar linkages, J. Mech. Des.
114 (1992) 153-159). Parameters are d_1 … d_8 and their hats.
"""

from explore.base.subroutines import subroutine

N_UNKNOWNS, N_POINTS, N_PARAMETERS = 8, 8, 16
#: Exchange of each unknown and its hat.
HATS = [1, 0, 3, 2, 5, 4, 7, 6]
#: Largest relative distance of hats from conjugates in candidates for real solutions.
NEARLY_REAL = 1e-6
#: Smallest size of the terms of an equation.
_TINY = 1e-300


@subroutine(inlined=True)
def magnitude(z):
    """The sum of the magnitudes of both parts: within the root of 2 of the magnitude, and cheap."""
    return abs(z.real) + abs(z.imag)


@subroutine()
def linearise(z, parameters, rates, jacobian, values, by_time):
    """Fill the equations' derivatives by the unknowns, their values, and their rates for those of the parameters.

    Each equation is divided by its largest derivative.
    """
    x, xh, a, ah, y, yh, b, bh = z[0], z[1], z[2], z[3], z[4], z[5], z[6], z[7]
    for j in range(N_POINTS):
        d, dh = parameters[j], parameters[N_POINTS + j]
        a_left, a_right, b_left, b_right = ah - dh, a - d, bh - dh, b - d
        a1, b1, c1 = a_left * x, a_right * xh, d * (ah - xh) + dh * (a_right - x)
        a2, b2, c2 = b_left * y, b_right * yh, d * (bh - yh) + dh * (b_right - y)
        g, h, e = b1 * c2 - b2 * c1, c1 * a2 - c2 * a1, a1 * b2 - a2 * b1
        by_g, by_h, by_e = h + e, g + e, g + h
        by_a1, by_a2 = by_e * b2 - by_h * c2, by_h * c1 - by_e * b1
        by_b1, by_b2 = by_g * c2 - by_e * a2, by_e * a1 - by_g * c1
        by_c1, by_c2 = by_h * a2 - by_g * b2, by_g * b1 - by_h * a1
        row = jacobian[j]
        row[0], row[1] = by_a1 * a_left - by_c1 * dh, by_b1 * a_right - by_c1 * d
        row[2], row[3] = by_b1 * xh + by_c1 * dh, by_a1 * x + by_c1 * d
        row[4], row[5] = by_a2 * b_left - by_c2 * dh, by_b2 * b_right - by_c2 * d
        row[6], row[7] = by_b2 * yh + by_c2 * dh, by_a2 * y + by_c2 * d
        largest = _TINY
        for k in range(N_UNKNOWNS):
            largest = max(largest, magnitude(row[k]))
        scale = 1.0 / largest
        for k in range(N_UNKNOWNS):
            row[k] *= scale
        values[j] = (g * h + e * by_e) * scale
        by_d = by_c1 * (ah - xh - dh) - by_b1 * xh + by_c2 * (bh - yh - dh) - by_b2 * yh
        by_dh = by_c1 * (a_right - x) - by_a1 * x + by_c2 * (b_right - y) - by_a2 * y
        by_time[j] = (by_d * rates[j] + by_dh * rates[N_POINTS + j]) * scale


@subroutine()
def eliminate(matrix, right):
    """Solve a linear system in place, by elimination with pivots; leave it as it is where it turns out singular."""
    n = N_UNKNOWNS
    for k in range(n):
        best, pivot = k, magnitude(matrix[k, k])
        for i in range(k + 1, n):
            size = magnitude(matrix[i, k])
            if size > pivot:
                best, pivot = i, size
        if not pivot > 1e-140:
            return
        for column in range(k, n):
            matrix[k, column], matrix[best, column] = matrix[best, column], matrix[k, column]
        right[k], right[best] = right[best], right[k]
        value = matrix[k, k]
        inverse = value.conjugate() * (1.0 / (value.real * value.real + value.imag * value.imag))
        matrix[k, k] = inverse
        for i in range(k + 1, n):
            factor = matrix[i, k] * inverse
            for column in range(k + 1, n):
                matrix[i, column] -= factor * matrix[k, column]
            right[i] -= factor * right[k]
    for k in range(n - 1, -1, -1):
        value = right[k]
        for column in range(k + 1, n):
            value -= matrix[k, column] * right[column]
        right[k] = value * matrix[k, k]
