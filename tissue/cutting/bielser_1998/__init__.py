"""The cut of Bielser, Maiwald and Gross (1998), sections 3 and 4, as it was printed."""
