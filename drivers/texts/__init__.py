"""Messages for people: code and facts here, English and Chinese in `texts/catalogue`."""
