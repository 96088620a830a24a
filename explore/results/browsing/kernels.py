"""Compiled loops over the cells of designs; none holds the interpreter's lock.

A cell is a range of values of a column. A table says of each cell what holds for all of its values, or that the values
have to be looked at: loops note such rows and leave them to the caller. Rows and bins have types without a sign, which
need no test for a negative index.
"""

from explore.base.compiling import compiled

#: Value in `failed` of a design that fails the conditions of several groups.
SEVERAL = 255

# Outcomes of a cell in a table: its designs meet the conditions, fail them, or have to be looked at.
MEETS, FAILS, UNSURE = 0, 1, 2


@compiled("void(float64[::1], float64[::1], uint16[::1], float64[::1], float64[::1], int64[::1])")
def assign_cells(values, edges, cells, least, greatest, counts):
    """Find the cell of each value: 0 for NaN, else 1 + the number of edges that are not above it.

    Also widens `least` and `greatest`, the values of each cell, and adds to `counts`.
    """
    for row in range(len(values)):
        value = values[row]
        cell = 0
        if value == value:
            low, high = 0, len(edges)
            while low < high:
                middle = (low + high) // 2
                if edges[middle] <= value:
                    low = middle + 1
                else:
                    high = middle
            cell = low + 1
            least[cell] = min(least[cell], value)
            greatest[cell] = max(greatest[cell], value)
        cells[row] = cell
        counts[cell] += 1


@compiled("int64(uint16[::1], uint8[::1], int64, uint8[::1], uint32[::1])")
def mark_failed(cells, outcomes, group, failed, unsure):
    """Note the group in `failed` for the designs whose cell fails; returns the number of unsure rows, listed."""
    n_unsure = 0
    for row in range(len(cells)):
        outcome = outcomes[cells[row]]
        before = failed[row]
        after = group if before == 0 else SEVERAL
        failed[row] = after if outcome == FAILS else before
        unsure[n_unsure] = row
        n_unsure += outcome == UNSURE
    return n_unsure


@compiled("int64(uint8[::1], int64, uint32[::1])")
def list_selected(failed, group, rows):
    """List the rows that fail nothing but perhaps a group; returns their number."""
    n_rows = 0
    for row in range(len(failed)):
        rows[n_rows] = row
        n_rows += (failed[row] == 0) | (failed[row] == group)
    return n_rows


@compiled("int64(uint16[::1], uint16[::1], uint32[::1], int64, int64[:, ::1], uint32[::1])")
def count_bins(cells, bins, rows, n_rows, counts, unsure):
    """Count rows by the bin of their cell; returns the number of unsure rows, which are listed.

    `counts` has four lines to be added up, so that a count need not wait for the one before. Its last two columns are
    the rows outside the bins and the unsure ones.
    """
    last = counts.shape[1] - 1
    before = counts[:, last].sum()
    for place in range(n_rows):
        counts[place & 3, bins[cells[rows[place]]]] += 1
    n_unsure = 0
    if counts[:, last].sum() > before:
        for place in range(n_rows):
            unsure[n_unsure] = rows[place]
            n_unsure += bins[cells[rows[place]]] == last
    return n_unsure


@compiled("int64(uint16[::1], uint16[::1], uint16[::1], uint16[::1], uint32[::1], int64, int64[:, ::1], uint32[::1])")
def count_pairs(cells_x, cells_y, bins_x, bins_y, rows, n_rows, counts, unsure):
    """Count rows by the bins of the cells of two columns, as `count_bins`, but in one table, (bins of y, bins of x)."""
    last_y, last_x = counts.shape[0] - 1, counts.shape[1] - 1
    n_unsure = 0
    for place in range(n_rows):
        row = rows[place]
        x, y = bins_x[cells_x[row]], bins_y[cells_y[row]]
        counts[y, x] += 1
        unsure[n_unsure] = row
        n_unsure += (x == last_x) | (y == last_y)
    return n_unsure
