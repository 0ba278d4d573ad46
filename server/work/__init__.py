"""The work around a worker's runs: waiting for a store that refuses, sharing runs, giving them turns."""
