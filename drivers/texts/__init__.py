"""Words for people: a code and its facts here, its English and Chinese in `texts/catalogue`."""
