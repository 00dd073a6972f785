from service.middleware.refusals import MAX_OF_ADDRESS, MAX_OF_ALL, WINDOW_SECONDS, RefusalBudget


def test_an_address_is_recorded_a_few_times_and_counted_then() -> None:
    budget = RefusalBudget()
    taken = [budget.take("a", 0.0) for _ in range(MAX_OF_ADDRESS + 7)]
    assert taken == [0] * MAX_OF_ADDRESS + [None] * 7
    assert budget.take("b", 1.0) == 7
    assert budget.take("b", 1.0) == 0
    assert budget.take("a", WINDOW_SECONDS - 0.1) is None
    assert budget.take("a", WINDOW_SECONDS) == 1


def test_all_addresses_together_are_bounded() -> None:
    budget = RefusalBudget()
    recorded = [budget.take(str(n), 0.0) for n in range(100_000)]
    assert sum(item is not None for item in recorded) == MAX_OF_ALL
    assert budget.take("new", WINDOW_SECONDS) == 100_000 - MAX_OF_ALL


def test_addresses_are_kept_in_bounded_memory() -> None:
    budget = RefusalBudget()
    for n in range(5000):
        budget.take(str(n), 0.0)
    assert len(vars(budget)["_of_address"]) <= 1024
