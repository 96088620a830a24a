"""The contract of a mechanism, to run in the tests of a mechanism: every promise that its results make."""

from explore.testing.contract import check_mechanism as check_mechanism
